#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vivant {

/// Which form of a kernel runs: register tiles per work-item (cpu), or small vectors and wide groups (gpu).
enum class DeviceClass { cpu, gpu };

/// Kernels that work by register tiles. Their size changes the time alone, never a bit of the result: sums
/// run over the same terms in the same order.
enum class TiledKernel {
  linear,
  outer_sum,  ///< the weight gradient of linear
  conv2d,     ///< tap by tap
  conv2d_weight_gradient,
  conv2d_winograd,  ///< CPUs alone, as its gradient
  conv2d_winograd_gradient,
  attention
};
inline constexpr std::array all_tiled_kernels = {
    TiledKernel::linear,          TiledKernel::outer_sum,
    TiledKernel::conv2d,          TiledKernel::conv2d_weight_gradient,
    TiledKernel::conv2d_winograd, TiledKernel::conv2d_winograd_gradient,
    TiledKernel::attention};
std::string_view name_of(TiledKernel kernel);

/// The register tile of one work-item: rows x vectors of the kernels' width; `groups` of them one below the
/// other (attention; else 1).
struct Tile {
  std::int64_t rows, vectors, groups = 1;
  bool operator==(const Tile&) const = default;
};

/// The tile that a kernel has on this class of devices for weights in panels of `panel` columns (16, 32, 48
/// or 64), as long as nothing else was measured.
Tile default_tile(TiledKernel kernel, DeviceClass device_class, std::int64_t panel);
/// All tiles worth measuring, the default one among them; none where the kernel does not run, or does not
/// know such panels.
std::vector<Tile> legal_tiles(TiledKernel kernel, DeviceClass device_class, std::int64_t panel);

/// The tiles that `vivant tune` found for one device, in a JSON file beside the compiled programs.
class TileTable {
 public:
  /// What is stored for `device`, which names it and its driver; empty when there is nothing. A file that is
  /// corrupt, of another device, or has a tile that is not legal is ignored with one line on stderr.
  static TileTable load(const std::string& device, DeviceClass device_class);
  /// Throws Error when the file cannot be written.
  void store(const std::string& device, DeviceClass device_class) const;
  /// Deletes what is stored; false when there was nothing.
  static bool remove(const std::string& device, DeviceClass device_class);
  /// Where it is stored.
  static std::filesystem::path file(const std::string& device, DeviceClass device_class);

  std::optional<Tile> find(TiledKernel kernel, std::int64_t panel) const;
  void set(TiledKernel kernel, std::int64_t panel, const Tile& tile) { tiles_[{kernel, panel}] = tile; }
  bool empty() const { return tiles_.empty(); }
  bool operator==(const TileTable&) const = default;

 private:
  std::map<std::pair<TiledKernel, std::int64_t>, Tile> tiles_;
};

}  // namespace vivant
