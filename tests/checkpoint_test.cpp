#include "vivant/io/checkpoint.hpp"

#include <random>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;

namespace {

Checkpoint example() {
  Checkpoint checkpoint;
  checkpoint.stage = "reconstruct";
  checkpoint.step = 1200;
  checkpoint.seed = 4294967295;
  checkpoint.config = "preset = \"demo\"\n[scene]\nsteps = 3  # a comment\n";
  checkpoint.device_class = "cpu";
  checkpoint.precision = "single";
  const std::vector<float> values = {1, -2, 3, 0.5f, 1e-30f, 6};
  for (const std::string name : {"parameter/a.weight", "adam_m/a.weight", "adam_v/a.weight"})
    checkpoint.tensors[name] = HostTensor({2, 3}, std::span<const float>(values));
  checkpoint.tensors["state/mean"] = HostTensor({6}, std::span<const float>(values));
  return checkpoint;
}

/// A one-line error that names the file and says what to do.
void check_refused(const std::filesystem::path& path) {
  const std::string error = error_of([&] { load_checkpoint(path); });
  CAPTURE(error);
  CHECK(contains(error, path.string()));
  CHECK(contains(error, "use an older checkpoint"));
}

}  // namespace

TEST_CASE("checkpoint: everything survives a round trip, and equal states give equal bytes") {
  const TemporaryFolder folder;
  const Checkpoint saved = example();
  save_checkpoint(folder / "a.safetensors", saved);
  const Checkpoint loaded = load_checkpoint(folder / "a.safetensors");
  CHECK(loaded.stage == saved.stage);
  CHECK(loaded.step == saved.step);
  CHECK(loaded.seed == saved.seed);
  CHECK(loaded.config == saved.config);
  CHECK(loaded.device_class == "cpu");
  CHECK(loaded.precision == "single");
  REQUIRE(loaded.tensors.size() == saved.tensors.size());
  for (const auto& [name, tensor] : saved.tensors)
    CHECK(loaded.tensor(name, tensor.shape).bytes == tensor.bytes);
  save_checkpoint(folder / "b.safetensors", loaded);
  CHECK(read_whole_file(folder / "a.safetensors") == read_whole_file(folder / "b.safetensors"));
}

TEST_CASE("checkpoint: a missing tensor and another shape are named with the file") {
  const TemporaryFolder folder;
  save_checkpoint(folder / "a.safetensors", example());
  const Checkpoint loaded = load_checkpoint(folder / "a.safetensors");
  const std::string missing = error_of([&] { loaded.tensor("parameter/b.weight", {2, 3}); });
  CHECK(contains(missing, "a.safetensors: the tensor 'parameter/b.weight' is missing"));
  CHECK(contains(missing, "config.toml"));
  const std::string other = error_of([&] { loaded.tensor("parameter/a.weight", {2, 4}); });
  CHECK(contains(other, "a.safetensors: the tensor 'parameter/a.weight' is F32 [2, 3]"));
  CHECK(contains(other, "needs [2, 4]"));
}

TEST_CASE("checkpoint: a file cut short at any length is refused") {
  const TemporaryFolder folder;
  save_checkpoint(folder / "a.safetensors", example());
  const std::string whole = read_whole_file(folder / "a.safetensors");
  for (std::size_t length = 0; length < whole.size(); length += 1 + length / 100) {
    write_file(folder / "b.safetensors", whole.substr(0, length));
    check_refused(folder / "b.safetensors");
  }
  write_file(folder / "b.safetensors", whole.substr(0, whole.size() - 1));
  check_refused(folder / "b.safetensors");
}

TEST_CASE("checkpoint: flipped bits are found wherever they are") {
  const TemporaryFolder folder;
  save_checkpoint(folder / "a.safetensors", example());
  const std::string whole = read_whole_file(folder / "a.safetensors");
  std::mt19937 random(3);
  for (int trial = 0; trial < 600; ++trial) {
    std::string damaged = whole;
    const std::size_t place = random() % whole.size();
    damaged[place] = static_cast<char>(damaged[place] ^ (1 << random() % 8));
    write_file(folder / "b.safetensors", damaged);
    CAPTURE(place);
    check_refused(folder / "b.safetensors");
  }
}

TEST_CASE("checkpoint: other files and other versions are refused") {
  const TemporaryFolder folder;
  TensorFile file;
  write_safetensors(folder / "other.safetensors", file);
  check_refused(folder / "other.safetensors");
  save_checkpoint(folder / "a.safetensors", example());
  file = read_safetensors(folder / "a.safetensors");
  file.metadata["version"] = "2";
  write_safetensors(folder / "newer.safetensors", file);
  CHECK(contains(error_of([&] { load_checkpoint(folder / "newer.safetensors"); }),
                 "it has version 2, this program reads version 1"));
  CHECK(contains(error_of([&] { load_checkpoint(folder / "none.safetensors"); }), "does not exist"));
}
