#pragma once
#include <filesystem>
#include <fstream>

#include "vivant/io/json.hpp"
#include "vivant/jobs/synth.hpp"
#include "vivant/jobs/train.hpp"

namespace vivant {

/// Makes a synthetic capture of 9 frames at 48x36 in `folder`/capture, and in `folder`/run a run of it that
/// has hardly been trained, but as `settings` say otherwise: for tests of what follows the training. Returns
/// the run.
inline std::filesystem::path make_tiny_run(Device& device, const std::filesystem::path& folder,
                                           bool with_person, std::uint32_t seed = 0,
                                           const std::vector<std::string>& settings = {}) {
  SynthOptions synth;
  synth.output = folder / "capture";
  synth.frames = 9;
  synth.width = 48;
  synth.height = 36;
  synth.seed = seed;
  synthesise(synth);
  if (!with_person) {
    nlohmann::json capture = read_json(synth.output / "transforms.json");
    capture.erase("human");
    for (nlohmann::json& frame : capture["frames"]) frame.erase("body_frame");
    std::ofstream(synth.output / "transforms.json") << capture;
  }
  TrainOptions train_options;
  train_options.capture = synth.output;
  train_options.run = folder / "run";
  std::vector<std::string> all = {"scene.steps=1",
                                  "human.steps=1",
                                  "scene.plane_size=16",
                                  "scene.unet_widths=[16]",
                                  "scene.rays=64",
                                  "scene.samples=16",
                                  "human.plane_size=16",
                                  "human.unet_widths=[16]",
                                  "human.rays=64",
                                  "human.samples=16",
                                  "features.steps=0",
                                  "style.steps=0",
                                  "training.preview_every=0",
                                  "human.corrections=learned"};
  all.insert(all.end(), settings.begin(), settings.end());
  train_options.config = load_config("demo", {}, all);
  Progress progress(ProgressMode::none, false);
  train(device, train_options, progress);
  return train_options.run;
}

}  // namespace vivant
