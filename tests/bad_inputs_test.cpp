// Bad inputs, as a user meets them: one clear line, the right exit code, and nothing half made left behind.
#include <opencv2/imgcodecs.hpp>

#include "tiny_training.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/jobs/run_folder.hpp"

using namespace vivant;

namespace {

std::string joined(const std::vector<std::string>& arguments) {
  std::string line;
  for (const std::string& argument : arguments) line += " '" + argument + "'";
  return line;
}

/// The command fails with this exit code and one line that holds every one of `parts`.
void check_refused(const std::string& command, int exit_code, const std::vector<std::string>& parts,
                   const std::string& environment = "") {
  const Finished run = run_vivant(command, environment);
  CAPTURE(command);
  CAPTURE(run.err);
  CHECK(run.exit_code == exit_code);
  CHECK(run.out.empty());
  CHECK(run.err.starts_with("vivant: "));
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  for (const std::string& part : parts) CHECK(contains(run.err, part));
}

/// A copy of the tiny capture that a test may spoil.
class SpoiltCapture {
 public:
  SpoiltCapture() { std::filesystem::copy(tiny_capture(), path(), std::filesystem::copy_options::recursive); }
  std::filesystem::path path() const { return folder_ / "capture"; }
  std::filesystem::path file(const std::string& name) const { return path() / name; }
  void cut(const std::string& name, double share) const {
    std::filesystem::resize_file(file(name),
                                 static_cast<std::uintmax_t>(share * std::filesystem::file_size(file(name))));
  }
  /// Training refuses it and leaves no run behind.
  void check(const std::vector<std::string>& parts) const {
    const std::filesystem::path run = folder_ / "run";
    check_refused("train " + path().string() + " --run " + run.string() + joined(tiny_settings(1, 1)), 1,
                  parts);
    CHECK_FALSE(std::filesystem::exists(run));
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace

TEST_CASE("bad inputs: a missing file is named") {
  const TemporaryFolder folder;
  const std::string nowhere = folder / "nowhere", run = folder / "run";
  check_refused("train " + nowhere + " --run " + run, 1, {nowhere, "does not exist"});
  check_refused("render " + nowhere + " -o " + run, 1, {nowhere, "no run folder"});
  check_refused("eval " + nowhere, 1, {nowhere, "no run folder"});
  check_refused("train --resume --run " + nowhere, 1, {nowhere, "no run folder"});
  check_refused("train " + tiny_capture().string() + " --run " + run + " --config " + nowhere, 1,
                {nowhere, "does not exist"});
  for (const std::string name : {"images/0003.png", "masks/0003.png", "poses.safetensors", "points.ply"}) {
    const SpoiltCapture capture;
    std::filesystem::remove(capture.file(name));
    capture.check({capture.file(name), "does not exist"});
  }
}

TEST_CASE("bad inputs: broken JSON is shown by its line") {
  const SpoiltCapture capture;
  capture.cut("transforms.json", 0.3);
  capture.check({capture.file("transforms.json").string() + ": line ", "broken JSON"});
}

TEST_CASE("bad inputs: a truncated image is found before the training") {
  for (const std::string name : {"images/0004.png", "masks/0004.png"})
    for (const double share : {0.9, 0.05, 0.0}) {
      const SpoiltCapture capture;
      capture.cut(name, share);
      capture.check({capture.file(name), share > 0 ? "the image is cut short" : "the file is empty"});
    }
  const SpoiltCapture capture;
  const cv::Mat picture = cv::imread(capture.file("images/0004.png"));
  REQUIRE(cv::imwrite(capture.file("photograph.jpg"), picture));
  capture.cut("photograph.jpg", 0.7);
  std::filesystem::rename(capture.file("photograph.jpg"), capture.file("images/0004.png"));
  capture.check({capture.file("images/0004.png"), "the image is cut short"});
}

TEST_CASE("bad inputs: a mask of another size, and a NaN in a pose") {
  {
    const SpoiltCapture capture;
    REQUIRE(cv::imwrite(capture.file("masks/0005.png"), cv::Mat(30, 20, CV_8UC1, cv::Scalar(255))));
    capture.check({capture.file("masks/0005.png"), "the mask is 20x30, its picture 48x32"});
  }
  const SpoiltCapture capture;
  TensorFile poses = read_safetensors(capture.file("poses.safetensors"));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(poses.tensors.at("pose").bytes.data() + 40, &nan, sizeof(nan));
  write_safetensors(capture.file("poses.safetensors"), poses);
  capture.check({capture.file("poses.safetensors"), "the pose of frame 0, joint 3", "is not finite"});
}

TEST_CASE("bad inputs: a style that is not an image") {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder / "run", styles = folder / "styles";
  const std::string picture = styles / "painting.png", train = "train " + tiny_capture().string() + " --run ";
  write_file(picture, "not a picture\n");
  const std::vector<std::string> parts = {picture, "not an image that can be read (PNG and JPEG work)"};
  check_refused(train + run.string() + " --styles " + styles.string() + joined(tiny_settings(1, 1)), 1,
                parts);
  CHECK_FALSE(std::filesystem::exists(run));

  const Finished trained = run_vivant(train + run.string() + joined(tiny_settings(1, 1)));
  REQUIRE_MESSAGE(trained.exit_code == 0, trained.err);
  for (const std::string name : {"film.mp4", "frames"}) {
    const std::filesystem::path output = folder / name;
    const std::string render = "render " + run.string() + " -o " + output.string() + " --style ";
    check_refused(render + picture, 1, parts);
    check_refused(render + picture + "s", 1, {picture + "s", "does not exist"});
    CHECK_FALSE(std::filesystem::exists(output));
  }
}

TEST_CASE("bad inputs: unknown settings are wrong usage") {
  const TemporaryFolder folder;
  const std::string train = "train " + tiny_capture().string() + " --run " + (folder / "run").string();
  check_refused(train + " --set scene.stepz=3", 2, {"unknown key 'scene.stepz'", "scene.steps"});
  check_refused(train + " --set scene.steps=many", 2, {"scene.steps"});
  check_refused(train + " --preset none", 2, {"there is no preset 'none'"});
  write_file(folder / "bad.toml", "[scene]\nsteps = 3\nrayz = 4\n");
  check_refused(train + " --config " + (folder / "bad.toml").string(), 2,
                {(folder / "bad.toml").string(), "line 3", "unknown key 'scene.rayz'"});
  write_file(folder / "bad.toml", "[scene\n");
  check_refused(train + " --config " + (folder / "bad.toml").string(), 2, {"line 1", "broken TOML"});
  CHECK_FALSE(std::filesystem::exists(folder / "run"));
}

TEST_CASE("bad inputs: without an OpenCL device the packages to install are named") {
  const TemporaryFolder empty;
  const std::string path = empty.path(), capture = tiny_capture();
  const std::vector<std::string> commands = {"train " + capture + " --run " + path + "/run",
                                             "render " + path + " -o " + path + "/x.mp4", "eval " + path,

                                             "devices", "bench linear --quick"};
  for (const std::string& command : commands)
    check_refused(command, 1, {"no OpenCL device was found", "pocl-opencl-icd"}, "OCL_ICD_VENDORS=" + path);
}

TEST_CASE("bad inputs: outputs that cannot be written, and checkpoints that are cut short") {
  const TemporaryFolder folder;
  const std::filesystem::path run = folder / "run";
  const std::string settings = joined(tiny_settings(2, 2));
  write_file(folder / "file", "");
  const std::string under_file = folder / "file/x";
  check_refused("train " + tiny_capture().string() + " --run " + under_file + settings, 1, {under_file});
  check_refused("synth --frames 3 --size 48x32 -o " + under_file, 1, {under_file});
  const Finished trained =
      run_vivant("train " + tiny_capture().string() + " --run " + run.string() + settings);
  REQUIRE_MESSAGE(trained.exit_code == 0, trained.err);
  check_refused("render " + run.string() + " --views test -o " + under_file + ".mp4", 1,
                {"cannot write", under_file});
  check_refused("render " + run.string() + " --views test -o " + under_file, 1, {under_file});

  const std::vector<std::filesystem::path> files = RunFolder::open_to_read(run).checkpoints();
  REQUIRE(files.size() == 2);
  const auto size = std::filesystem::file_size(files[1]);
  const std::string whole = read_whole_file(files[1]);
  std::filesystem::resize_file(files[1], size / 2);
  const Finished resumed = run_vivant("train --resume --run " + run.string());
  CAPTURE(resumed.err);
  CHECK(resumed.exit_code == 0);
  CHECK(contains(resumed.err, "warning: " + files[1].string()));
  CHECK(contains(resumed.err, "cut short"));
  CHECK(read_whole_file(files[1]) == whole);

  for (const std::filesystem::path& file : files) std::filesystem::resize_file(file, size / 2);
  const std::vector<std::string> parts = {"no checkpoint of the run", "cut short"};
  check_refused("render " + run.string() + " -o " + (folder / "x.mp4").string(), 1, parts);
  check_refused("eval " + run.string(), 1, parts);
  check_refused("train --resume --run " + run.string(), 1, parts);
  CHECK_FALSE(std::filesystem::exists(folder / "x.mp4"));
}
