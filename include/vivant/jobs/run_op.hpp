#pragma once
#include <nlohmann/json.hpp>

#include "vivant/io/tensor_file.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// Inputs, outputs and attributes of an op with their types, shapes and standard values.
nlohmann::json describe_op(const OpInfo& info);

/// Attributes from "name=value" texts, each read as its attribute's type. Throws UsageError.
nlohmann::json parse_attributes(const OpInfo& info, const std::vector<std::string>& settings);

/// Runs one op on the tensors of `in`, looked up by the names of the op's inputs; optional ones may be
/// missing. Returns its outputs by name. With `gradients`, `in` also holds grad_<output> for at least one
/// output (zeros for the others), and the result also holds grad_<input> for every real input, zeros where
/// the op passes none. Reals are F32 in the result and may be of any floating-point type in `in`. Throws
/// Error for missing, unknown or ill-typed tensors, naming the file, and for the shapes that the op refuses.
TensorFile run_op(Device& device, const OpInfo& info, const nlohmann::json& attributes, const TensorFile& in,
                  bool gradients);

}  // namespace vivant
