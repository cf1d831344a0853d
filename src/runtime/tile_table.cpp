#include "vivant/runtime/tile_table.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "runtime/program_cache.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view names[] = {"linear",          "outer_sum",
                                      "conv2d",          "conv2d_weight_gradient",
                                      "conv2d_winograd", "conv2d_winograd_gradient",
                                      "attention"};
constexpr std::string_view format = "vivant tiles 1";

bool winograd(TiledKernel kernel) {
  return kernel == TiledKernel::conv2d_winograd || kernel == TiledKernel::conv2d_winograd_gradient;
}

/// Attention's panels are 64 columns. Its vectors are fixed: as many keys as they hold are weighed at a time,
/// and another number would round differently.
std::vector<Tile> attention_tiles(DeviceClass device_class, std::int64_t panel) {
  if (panel != 64) return {};
  if (device_class == DeviceClass::gpu) return {{1, 2, 1}, {2, 2, 1}, {4, 2, 1}, {1, 2, 2}, {2, 2, 2}};
  std::vector<Tile> tiles;
  for (const std::int64_t rows : {3, 4, 6, 7})
    for (const std::int64_t groups : {4, 8, 16}) tiles.push_back({rows, 4, groups});
  return tiles;
}

std::vector<Tile> legal_cpu_tiles(TiledKernel kernel, std::int64_t panel) {
  constexpr std::int64_t least_accumulators = 4, most_accumulators = 28;  // of at most 32 registers
  const std::int64_t width = panel / 16;
  std::vector<Tile> tiles;
  for (std::int64_t vectors = (width + 1) / 2; vectors <= width; ++vectors) {
    if (width % vectors != 0 || (kernel == TiledKernel::conv2d_winograd && vectors != width)) continue;
    for (const std::int64_t rows : {2, 3, 4, 6, 7, 8, 9, 12, 14}) {
      const std::int64_t accumulators = rows * vectors;
      if (accumulators < least_accumulators || accumulators > most_accumulators) continue;
      if (kernel == TiledKernel::conv2d_winograd && rows > 12) continue;  // of the tiles that share a cache
      tiles.push_back({rows, vectors});
    }
  }
  return tiles;
}

nlohmann::json to_json(const Tile& tile) { return {tile.rows, tile.vectors, tile.groups}; }

/// Throws std::exception when the text is not what `store` writes for this device.
std::map<std::pair<TiledKernel, std::int64_t>, Tile> parse(const std::string& text, const std::string& device,
                                                           DeviceClass device_class) {
  const nlohmann::json json = nlohmann::json::parse(text);
  if (json.at("format") != format) fail("another version of vivant wrote them");
  if (json.at("device") != device) fail("they were measured on another device or driver");
  std::map<std::pair<TiledKernel, std::int64_t>, Tile> tiles;
  for (const nlohmann::json& row : json.at("tiles")) {
    const auto name = std::find(std::begin(names), std::end(names), row.at("kernel").get<std::string>());
    const std::int64_t panel = row.at("panel");
    const auto numbers = row.at("tile").get<std::array<std::int64_t, 3>>();
    const Tile tile = {numbers[0], numbers[1], numbers[2]};
    if (name == std::end(names)) fail("there is no kernel {}", row.at("kernel").dump());
    const auto kernel = static_cast<TiledKernel>(name - std::begin(names));
    const std::vector<Tile> legal = legal_tiles(kernel, device_class, panel);
    if (std::find(legal.begin(), legal.end(), tile) == legal.end())
      fail("{} cannot have the tile {} for {} columns", *name, row.at("tile").dump(), panel);
    tiles[{kernel, panel}] = tile;
  }
  return tiles;
}

}  // namespace

std::string_view name_of(TiledKernel kernel) { return names[static_cast<int>(kernel)]; }

Tile default_tile(TiledKernel kernel, DeviceClass device_class, std::int64_t panel) {
  const bool gpu = device_class == DeviceClass::gpu;
  if (kernel == TiledKernel::attention) return gpu ? Tile{2, 2, 1} : Tile{6, 4, 8};
  if (gpu) return {4, 2};
  // As many accumulators as 32 vector registers hold; Winograd's rows divide the 24 tiles of a block.
  const std::int64_t width = panel / 16;
  const Tile tiles[] = {{14, 1}, {12, 2}, {8, 3}, {6, 4}};
  const Tile tile = tiles[std::clamp<std::int64_t>(width, 1, 4) - 1];
  return kernel == TiledKernel::conv2d_winograd && width == 1 ? Tile{12, 1} : tile;
}

std::vector<Tile> legal_tiles(TiledKernel kernel, DeviceClass device_class, std::int64_t panel) {
  if (panel < 16 || panel > 64 || panel % 16 != 0) return {};
  if (kernel == TiledKernel::attention) return attention_tiles(device_class, panel);
  if (device_class == DeviceClass::cpu) return legal_cpu_tiles(kernel, panel);
  if (winograd(kernel)) return {};
  std::vector<Tile> tiles;
  for (const std::int64_t vectors : {1, 2, 4})
    for (const std::int64_t rows : {2, 4, 8}) tiles.push_back({rows, vectors});
  return tiles;
}

fs::path TileTable::file(const std::string& device, DeviceClass device_class) {
  const std::string key = device + (device_class == DeviceClass::gpu ? "\ngpu" : "\ncpu");
  return cache_folder() / fmt::format("tiles-{:016x}.json", stable_hash(key));
}

TileTable TileTable::load(const std::string& device, DeviceClass device_class) {
  const fs::path path = file(device, device_class);
  TileTable table;
  std::ifstream in(path, std::ios::binary);
  if (!in) return table;
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  std::string reason;
  try {
    table.tiles_ = parse(text, device, device_class);
    return table;
  } catch (const Error& error) {
    reason = error.what();
  } catch (const std::exception&) {
    reason = "the file is damaged";
  }
  fmt::print(stderr, "warning: the tiles in {} are ignored, {}: run `vivant tune` again\n", path.string(),
             reason);
  return table;
}

void TileTable::store(const std::string& device, DeviceClass device_class) const {
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& [key, tile] : tiles_)
    rows.push_back({{"kernel", name_of(key.first)}, {"panel", key.second}, {"tile", to_json(tile)}});
  const nlohmann::json json = {{"format", format}, {"device", device}, {"tiles", rows}};
  const fs::path path = file(device, device_class);
  const fs::path temporary = path.string() + fmt::format(".{}.tmp", getpid());
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  {
    std::ofstream out(temporary, std::ios::binary);
    out << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    if (!out) fail("{} cannot be written: set VIVANT_CACHE to a folder that can", path.string());
  }
  fs::rename(temporary, path);
}

bool TileTable::remove(const std::string& device, DeviceClass device_class) {
  return fs::remove(file(device, device_class));
}

std::optional<Tile> TileTable::find(TiledKernel kernel, std::int64_t panel) const {
  const auto found = tiles_.find({kernel, panel});
  return found == tiles_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace vivant
