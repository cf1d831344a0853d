// A batch of films that is interrupted in any way and gone on with gives the files of one that is not.
#include <chrono>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "tiny_training.hpp"

using namespace vivant;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

/// What each finished file of a kind holds, by its path in the folder, and when it was written.
struct File {
  std::string bytes;
  fs::file_time_type written;
};
std::map<std::string, File> files_in(const fs::path& folder, const std::string& extension) {
  std::map<std::string, File> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& path = entry.path();
    if (path.extension() == extension && !path.filename().string().starts_with('.'))
      files[fs::relative(path, folder)] = {read_whole_file(path), entry.last_write_time()};
  }
  return files;
}

std::size_t picture_count(const fs::path& folder) { return files_in(folder, ".png").size(); }

/// What was kept is whole and is not written again.
void check_kept(const std::map<std::string, File>& before, const std::map<std::string, File>& after) {
  for (const auto& [name, file] : before) {
    CAPTURE(name);
    REQUIRE(after.contains(name));
    CHECK(after.at(name).written == file.written);
    CHECK(after.at(name).bytes == file.bytes);
  }
}

void check_same(const std::map<std::string, File>& expected, const std::map<std::string, File>& got) {
  CHECK(got.size() == expected.size());
  for (const auto& [name, file] : expected) {
    CAPTURE(name);
    REQUIRE(got.contains(name));
    CHECK(got.at(name).bytes == file.bytes);
  }
}

}  // namespace

TEST_CASE("batch: after Ctrl-C and kill -9 the same command goes on, to the same films") {
  const TemporaryFolder folder;
  const std::string run = folder / "run";
  std::string train = "train " + tiny_capture().string() + " --run " + run;
  for (const std::string& argument : tiny_settings(5, 5)) train += " " + argument;
  train += " --set features.steps=1 --set features.views=1";
  const Finished trained = run_vivant(train);
  REQUIRE_MESSAGE(trained.exit_code == 0, trained.err);
  cv::Mat style(64, 64, CV_8UC3);
  cv::randu(style, 0, 255);
  REQUIRE(cv::imwrite(folder / "style.png", style));
  for (const std::string name : {"whole", "stopped"})
    write_file(folder / (name + "/jobs.toml"),
               fmt::format("run = \"{}\"\nsize = \"80x64\"\nstyle = [\"none\", \"../style.png\"]\n"
                           "[[job]]\nviews = \"all\"\n[[job]]\nviews = \"orbit\"\norbit_frames = 8\n",
                           run));
  const auto batch = [&](const std::string& name) {
    return std::vector<std::string>{"batch", folder / (name + "/jobs.toml")};
  };
  const fs::path log = folder / "log", films = folder / "stopped/films";
  REQUIRE_MESSAGE(BackgroundVivant(batch("whole"), log).finish() == 0, read_whole_file(log));
  const auto pictures = files_in(folder / "whole/films", ".png"),
             videos = files_in(folder / "whole/films", ".mp4");
  REQUIRE(pictures.size() == 2 * (9 + 8));
  REQUIRE(videos.size() == 4);

  const auto stop = [&](int signal, std::size_t at) {
    BackgroundVivant program(batch("stopped"), log);
    while (program.runs() && picture_count(films) < at) std::this_thread::sleep_for(2ms);
    const int code = program.finish(signal);
    const auto kept = files_in(films, ".png");
    CAPTURE(read_whole_file(log));
    CHECK(code == (signal == SIGINT ? 130 : 128 + signal));
    CHECK(kept.size() >= at);
    CHECK(kept.size() < pictures.size());
    return kept;
  };
  const auto first = stop(SIGINT, 3);
  CHECK(contains(read_whole_file(log), "the same command goes on from here"));
  const auto second = stop(SIGKILL, 12);
  check_kept(first, second);
  const auto third = stop(SIGKILL, 24);
  check_kept(second, third);
  CHECK(BackgroundVivant(batch("stopped"), log).finish() == 0);
  const auto last = files_in(films, ".png");
  check_kept(third, last);
  check_same(pictures, last);
  check_same(videos, files_in(films, ".mp4"));
}
