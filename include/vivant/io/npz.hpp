#pragma once
#include <filesystem>

#include "vivant/io/tensor_file.hpp"

namespace vivant {

/// Reads a NumPy .npz archive (entries stored or deflated). Arrays are little-endian f4, f8, i1 to i8, u1 to
/// u8 or bool, in C or Fortran order (turned to C order). Arrays of other types (objects, strings) are never
/// decoded: they are left out and named in metadata["skipped"]. Throws Error with one line when the archive
/// is malformed.
TensorFile read_npz(const std::filesystem::path& path);

/// Reads a single .npy array.
HostTensor read_npy(const std::filesystem::path& path);

}  // namespace vivant
