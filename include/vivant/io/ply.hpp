#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace vivant {

/// Points with optional colours (empty, or one RGB a point).
struct PointCloud {
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::array<std::uint8_t, 3>> colours;
};

/// Reads the vertices of an ASCII or binary (either byte order) PLY file; other elements and properties are
/// skipped. Throws Error with one line when the file is malformed, cut short or holds a position that is not
/// finite.
PointCloud read_ply(const std::filesystem::path& path);

/// Writes a little-endian binary PLY file, atomically.
void write_ply(const std::filesystem::path& path, const PointCloud& cloud);

}  // namespace vivant
