#include "vivant/jobs/run_folder.hpp"

#include <nlohmann/json.hpp>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

namespace {

Checkpoint at_step(std::int64_t step) {
  Checkpoint checkpoint;
  checkpoint.stage = "reconstruct";
  checkpoint.step = step;
  const std::vector<float> values(100, static_cast<float>(step));
  checkpoint.tensors["parameter/w"] = HostTensor({100}, std::span<const float>(values));
  return checkpoint;
}

}  // namespace

TEST_CASE("run folder: created once, locked against two writers, open to readers, relocatable") {
  const TemporaryFolder folder;
  {
    const RunFolder run = RunFolder::create(folder / "runs/a", "preset = \"demo\"\n");
    CHECK(read_whole_file(run.config()) == "preset = \"demo\"\n");
    CHECK(std::filesystem::is_directory(run.previews()));
    CHECK(std::filesystem::is_directory(run.capture()));
    CHECK_FALSE(run.newest_checkpoint());
    run.save(at_step(5), 5, 3);
    CHECK(contains(error_of([&] { RunFolder::open_to_write(folder / "runs/a"); }),
                   "another process is writing"));
    CHECK(RunFolder::open_to_read(folder / "runs/a").newest_checkpoint()->number == 5);
  }
  CHECK(contains(error_of([&] { RunFolder::create(folder / "runs/a", ""); }), "already holds a run"));
  CHECK(contains(error_of([&] { RunFolder::open_to_read(folder / "none"); }), "no run folder"));
  CHECK(contains(error_of([&] { RunFolder::open_to_write(folder.path()); }), "no config.toml"));
  std::filesystem::rename(folder / "runs", folder / "moved");
  std::filesystem::remove(folder / "moved/a/previews");
  CHECK(RunFolder::open_to_write(folder / "moved/a").newest_checkpoint()->checkpoint.step == 5);
  CHECK(std::filesystem::is_directory(folder / "moved/a/previews"));
  write_file(folder / "file", "");
  CHECK(contains(error_of([&] { RunFolder::create(folder / "file/run", ""); }), "cannot make the folder"));
}

TEST_CASE("run folder: the last checkpoints are kept, and the newest whole one is found") {
  const TemporaryFolder folder;
  const RunFolder run = RunFolder::create(folder / "run", "");
  for (std::int64_t step : {1, 20, 300, 4000}) run.save(at_step(step), step, 3);
  REQUIRE(run.checkpoints().size() == 3);
  CHECK(run.checkpoints().front().filename() == "00000020.safetensors");
  write_file(folder / "run/checkpoints/00009999.safetensors.tmp", "unfinished");
  write_file(folder / "run/checkpoints/notes.safetensors", "not a number");
  CHECK(run.newest_checkpoint()->number == 4000);

  std::filesystem::resize_file(run.checkpoints()[2], 400);
  std::string middle = read_whole_file(run.checkpoints()[1]);
  middle.back() ^= 1;
  write_file(run.checkpoints()[1], middle);
  const auto newest = run.newest_checkpoint();
  CHECK(newest->number == 20);
  CHECK(newest->checkpoint.tensor("parameter/w", {100}).as_floats()[99] == 20);
  REQUIRE(newest->damaged.size() == 2);
  CHECK(contains(newest->damaged[0], "00004000.safetensors"));
  CHECK(contains(newest->damaged[1], "damaged"));

  std::filesystem::resize_file(run.checkpoints()[0], 0);
  CHECK(contains(error_of([&] { run.newest_checkpoint(); }), "no checkpoint of the run"));
}

TEST_CASE("run folder: metrics end where the resumed run goes on") {
  const TemporaryFolder folder;
  const RunFolder run = RunFolder::create(folder / "run", "");
  run.rewind_metrics("reconstruct", 3);  // nothing there yet
  std::string rows, kept;
  for (const char* stage : {"reconstruct", "features"})
    for (int step : {10, 20, 30}) {
      rows += nlohmann::json({{"stage", stage}, {"step", step}}).dump() + "\n";
      if (stage == std::string("reconstruct") || step <= 20) kept = rows;
    }
  write_file(run.metrics(), rows + "{\"stage\":\"fea");
  std::ofstream open_before(run.metrics(), std::ios::app);
  run.rewind_metrics("features", 25);
  CHECK(read_whole_file(run.metrics()) == kept);
  const std::string row = "{\"stage\":\"features\",\"step\":21}";
  open_before << row << std::endl << row << std::flush;  // the second is cut short
  run.rewind_metrics("features", 25);
  CHECK(read_whole_file(run.metrics()) == kept + row + "\n");
  run.rewind_metrics("features", 20);
  CHECK(read_whole_file(run.metrics()) == kept);
  run.rewind_metrics("reconstruct", 30);
  CHECK(std::count(kept.begin(), kept.end(), '\n') == 5);
  const std::string left = read_whole_file(run.metrics());
  CHECK(std::count(left.begin(), left.end(), '\n') == 3);
  run.rewind_metrics("reconstruct", 0);
  CHECK(read_whole_file(run.metrics()).empty());
}
