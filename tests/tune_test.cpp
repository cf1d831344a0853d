// Register tiles: which are legal, that they change no bit, and how `vivant tune` stores those it finds.
#include <nlohmann/json.hpp>

#include "bench/ops/tune.hpp"
#include "child_process.hpp"
#include "environment.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/conv2d.hpp"
#include "vivant/ops/linear.hpp"

using namespace vivant;

namespace {

const std::vector<std::int64_t> panels = {16, 32, 48, 64};

/// A cache folder for one test.
struct OwnCache {
  TemporaryFolder folder;
  ScopedVariable variable{"VIVANT_CACHE", folder.path().string()};
};

/// Every kernel that has a tile, forward and backward, at sizes that no tile divides.
struct Everything {
  Value input(const Shape& shape) {
    std::vector<float> data(shape.elements());
    for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<float>((i * 37 + 11) % 101) / 50 - 1;
    return graph.constant(shape, std::span<const float>(data));
  }
  void add(Value y, const Values& wrt) {
    outputs.push_back(y);
    for (const Value gradient : differentiate(graph, {y}, {input(Shape(y.shape()))}, wrt))
      outputs.push_back(gradient);
  }
  explicit Everything(std::int64_t columns) {
    const Value x = input({61, 37}), w = input({37, columns});
    add(linear(x, w), {x, w});
    for (const std::int64_t channels : {16, 21}) {
      const Value image = input({29, 30, channels}), kernel = input({3, 3, channels, columns});
      add(conv2d(image, kernel), {image, kernel});
    }
    const Value q = input({53, 24}), k = input({70, 24}), values = input({70, columns});
    add(attend(q, k, values, {}, {.scale = 0.2}), {q, k, values});
  }
  std::vector<std::vector<float>> run(Device& device) {
    Executor executor(device, graph, outputs);
    executor.run();
    std::vector<std::vector<float>> found;
    for (const Value output : outputs) found.push_back(executor.read(output));
    return found;
  }
  Graph graph;
  Values outputs;
};

/// The first or the last legal tile of every kernel.
TileTable extreme_tiles(DeviceClass device_class, bool last) {
  TileTable table;
  for (const TiledKernel kernel : all_tiled_kernels)
    for (const std::int64_t panel : panels) {
      const std::vector<Tile> tiles = legal_tiles(kernel, device_class, panel);
      if (!tiles.empty()) table.set(kernel, panel, last ? tiles.back() : tiles.front());
    }
  return table;
}

TileTable one_tile() {
  TileTable table;
  table.set(TiledKernel::linear, 64, {7, 4});
  return table;
}

}  // namespace

TEST_CASE("tune: defaults are legal, and nothing else than panels has tiles") {
  for (const DeviceClass device_class : {DeviceClass::cpu, DeviceClass::gpu})
    for (const TiledKernel kernel : all_tiled_kernels) {
      CAPTURE(name_of(kernel));
      for (const std::int64_t panel : panels) {
        const std::vector<Tile> tiles = legal_tiles(kernel, device_class, panel);
        if (tiles.empty()) continue;
        CHECK(std::count(tiles.begin(), tiles.end(), default_tile(kernel, device_class, panel)) == 1);
        const std::int64_t width = device_class == DeviceClass::cpu ? 16 : 4;
        for (const Tile& tile : tiles) {
          CHECK(panel % (tile.vectors * width) == 0);
          CHECK(tile.rows <= 14);  // what the packed operands of outer_sum leave room for
        }
      }
      for (const std::int64_t panel : {0, 15, 20, 80})
        CHECK(legal_tiles(kernel, device_class, panel).empty());
    }
  CHECK(legal_tiles(TiledKernel::conv2d_winograd, DeviceClass::gpu, 32).empty());
  CHECK(legal_tiles(TiledKernel::attention, DeviceClass::cpu, 32).empty());
}

TEST_CASE("tune: tiles change no bit of any result") {
  for (const auto& [name, columns] : {std::pair(std::string("cpu"), 16), {"cpu", 64}, {"gpu", 64}}) {
    CAPTURE(name);
    CAPTURE(columns);
    Device device(DeviceOptions{"", name, false, "fp32"});
    Everything work(columns);
    device.use_tiles({});
    const auto expected = work.run(device);
    for (const bool last : {false, true}) {
      CAPTURE(last);
      device.use_tiles(extreme_tiles(device.device_class(), last));
      const auto found = work.run(device);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        CAPTURE(i);
        CHECK(found[i] == expected[i]);
      }
    }
  }
}

TEST_CASE("tune: a table is stored for one device and read again") {
  const OwnCache cache;
  const TileTable table = one_tile();
  CHECK(TileTable::load("device", DeviceClass::cpu).empty());
  table.store("device", DeviceClass::cpu);
  CHECK(TileTable::load("device", DeviceClass::cpu) == table);
  CHECK(TileTable::load("another", DeviceClass::cpu).empty());
  CHECK(TileTable::load("device", DeviceClass::gpu).empty());
  CHECK(table.find(TiledKernel::linear, 64) == Tile{7, 4});
  CHECK_FALSE(table.find(TiledKernel::linear, 32));
  CHECK_FALSE(table.find(TiledKernel::conv2d, 64));
  CHECK(TileTable::remove("device", DeviceClass::cpu));
  CHECK_FALSE(TileTable::remove("device", DeviceClass::cpu));
  CHECK(std::filesystem::is_empty(cache.folder.path()));
}

TEST_CASE("tune: stored tiles reach the kernels of later runs; damaged and foreign ones are ignored") {
  const OwnCache cache;
  const Device device(DeviceOptions{"", "cpu", false, "fp32"});
  const std::filesystem::path file = TileTable::file(device.identity(), DeviceClass::cpu);
  const auto run = [] { return run_vivant("bench linear --quick --verbose --device-class cpu --math fp32"); };
  const std::string tuned = "-DPANEL=64 -DTILE_ROWS=7 -DTILE_VECTORS=4";

  Finished finished = run();
  REQUIRE(finished.exit_code == 0);
  CHECK(contains(finished.err, "built linear.cl"));
  CHECK_FALSE(contains(finished.err, tuned));
  one_tile().store(device.identity(), DeviceClass::cpu);
  finished = run();
  CHECK(contains(finished.err, tuned));
  CHECK_FALSE(contains(finished.err, "warning"));

  const std::string whole = read_whole_file(file);
  nlohmann::json foreign = nlohmann::json::parse(whole), illegal = foreign, unknown = foreign, old = foreign;
  foreign["device"] = "another device";
  illegal["tiles"][0]["tile"] = {700, 4, 1};
  unknown["tiles"][0]["kernel"] = "no such kernel";
  old["format"] = "vivant tiles 0";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "the file is damaged"},
      {whole.substr(0, whole.size() / 2), "the file is damaged"},
      {"[1, 2]", "the file is damaged"},
      {foreign.dump(), "measured on another device or driver"},
      {illegal.dump(), "linear cannot have the tile [700,4,1] for 64 columns"},
      {unknown.dump(), "no kernel \"no such kernel\""},
      {old.dump(), "another version of vivant"}};
  for (const auto& [text, reason] : cases) {
    write_file(file, text);
    finished = run_vivant("devices --device-class cpu");
    CAPTURE(finished.err);
    CHECK(finished.exit_code == 0);
    CHECK(contains(finished.err, reason));
    CHECK(contains(finished.err, "run `vivant tune` again"));
    CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 1);
  }
  CHECK_FALSE(contains(run().err, tuned));
}

TEST_CASE("tune: another tile is taken only where it is clearly faster") {
  const Tile standard = {6, 4}, other = {7, 4};
  const auto chosen = [&](double seconds) {
    return bench::choose({{standard, 1.0}, {other, seconds}}, standard).chosen.tile;
  };
  CHECK(chosen(0.98) == standard);
  CHECK(chosen(1.5) == standard);
  CHECK(chosen(0.9) == other);
  CHECK_THROWS_WITH(bench::choose({{other, 1.0}}, standard), "the default tile was not measured");
}

TEST_CASE("tune: the command measures, stores, and forgets") {
  const OwnCache cache;
  const Device device(DeviceOptions{"", "gpu", false, "fp32"});
  Finished finished = run_vivant("tune attention --quick --device-class gpu --progress json");
  CAPTURE(finished.err);
  REQUIRE(finished.exit_code == 0);
  CHECK(contains(finished.out, "attention                       64       2x2"));
  CHECK(contains(finished.err, "\"stage\":\"tune\""));
  const TileTable table = TileTable::load(device.identity(), DeviceClass::gpu);
  REQUIRE(table.find(TiledKernel::attention, 64));
  CHECK_FALSE(table.find(TiledKernel::linear, 64));
  finished = run_vivant("tune --reset --device-class gpu");
  CHECK(contains(finished.out, "is deleted"));
  CHECK(TileTable::load(device.identity(), DeviceClass::gpu).empty());
  CHECK(contains(run_vivant("tune --reset --device-class gpu").out, "nothing is stored"));
  CHECK(run_vivant("tune no_such_kernel").exit_code == 2);
  CHECK(run_vivant("tune --reset --quick").exit_code == 2);
}
