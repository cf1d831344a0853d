#pragma once
#include <filesystem>

#include "vivant/io/tensor_file.hpp"

namespace vivant {

/// Reads a .safetensors file. Throws Error with one line for every malformed file: cut short, offsets outside
/// the file or overlapping, a size that is not the product of the shape, broken JSON.
TensorFile read_safetensors(const std::filesystem::path& path);

/// Writes atomically: a temporary file in the same folder, fsync, rename, fsync of the folder. After a crash
/// the file is the old one or the new one. The bytes depend on the content alone.
void write_safetensors(const std::filesystem::path& path, const TensorFile& file);

}  // namespace vivant
