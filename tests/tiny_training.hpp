#pragma once
#include <string>
#include <vector>

#include "child_process.hpp"

namespace vivant {

/// Settings of `vivant train` with which a few steps of the reconstruction take a second; later stages are
/// left out.
inline std::vector<std::string> tiny_settings(int steps, int checkpoint_every) {
  std::vector<std::string> settings = {
      "training.preview_every=0", "training.report_every=1",   "scene.plane_size=64",
      "scene.plane_channels=16",  "scene.unet_widths=[16,16]", "scene.rays=64",
      "scene.batches_per_step=1", "scene.samples=16",          "scene.unet_rate=0.0033333333333333335",
      "human.plane_size=16",      "human.plane_channels=16",   "human.unet_widths=[16,16]",
      "human.rays=256",           "human.batches_per_step=1",  "human.sample_step=0.03",
      "human.box_points=64",      "human.correction_start=0",  "human.error_width=16"};
  settings.insert(settings.end(), {"scene.cameras=refined", "features.steps=0", "style.steps=0"});
  settings.push_back(fmt::format("training.checkpoint_every={}", checkpoint_every));
  settings.push_back(fmt::format("scene.steps={}", steps));
  settings.push_back(fmt::format("human.steps={}", steps));
  std::vector<std::string> arguments = {"--preset", "demo"};
  for (const std::string& setting : settings) {
    arguments.emplace_back("--set");
    arguments.push_back(setting);
  }
  return arguments;
}

/// A capture of a walker, 48x32; made once.
inline const std::filesystem::path& tiny_capture() {
  static const TemporaryFolder folder;
  static const std::filesystem::path capture = [] {
    const std::filesystem::path path = folder / "walk";
    const Finished run = run_vivant("synth -o " + path.string() + " --frames 9 --size 48x32");
    REQUIRE_MESSAGE(run.exit_code == 0, run.err);
    return path;
  }();
  return capture;
}

}  // namespace vivant
