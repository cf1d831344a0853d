#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// Named settings of an op, as JSON values.
class Attributes {
 public:
  Attributes() = default;
  explicit Attributes(nlohmann::json values) : values_(std::move(values)) {}
  double number(const std::string& name) const { return values_.at(name).get<double>(); }
  std::int64_t integer(const std::string& name) const { return values_.at(name).get<std::int64_t>(); }
  bool flag(const std::string& name) const { return values_.at(name).get<bool>(); }
  std::string text(const std::string& name) const { return values_.at(name).get<std::string>(); }

 private:
  nlohmann::json values_ = nlohmann::json::object();
};

/// An input or output of an op.
struct Port {
  std::string name;
  std::string shape;  ///< for people: "[rays, samples, C]"
  DType dtype = DType::real;
  bool optional = false;
};

struct AttributeInfo {
  std::string name;
  nlohmann::json standard;  ///< the value when none is given; its JSON type is the attribute's type
  std::string summary;
};

/// Everything needed to use an op by name: from the command line, the test cases and the benchmarks.
struct OpInfo {
  std::string name;
  std::string summary;
  std::vector<Port> inputs, outputs;
  std::vector<AttributeInfo> attributes;
  std::function<Values(Graph&, const Values&, const Attributes&)> build;

  /// The given values over the standard ones. Throws UsageError for unknown names and wrong types.
  Attributes complete(const nlohmann::json& given) const;
};

/// All ops, by name.
const std::vector<OpInfo>& all_ops();
/// Throws UsageError when there is none of this name.
const OpInfo& op_info(const std::string& name);

/// A global of this type, in an op's source file, adds the op to the registry.
struct RegisterOp {
  explicit RegisterOp(OpInfo info);
};

}  // namespace vivant
