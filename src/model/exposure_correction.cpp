#include "vivant/model/exposure_correction.hpp"

#include "vivant/model/field.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/reduction.hpp"

namespace vivant {
namespace {

/// Gains less 1, and offsets.
constexpr const char *gains = "scene.exposure_gains", *offsets = "scene.exposure_offsets";
constexpr double least_gain = 0.1;  // it divides

}  // namespace

ExposureCorrection::ExposureCorrection(ParameterStore& store, int training_frames)
    : store_(store), frames_(training_frames) {
  for (const char* name : {gains, offsets})
    store.add(name, {frames_, 3}, group_exposures,
              std::vector<float>(3 * static_cast<std::size_t>(frames_), 0.0f));
}

Value ExposureCorrection::exposed(Graph& graph, Value colours, Value frames) const {
  const auto of_frames = [&](const char* name) { return gather_rows(store_.value(graph, name), frames); };
  return add(add(colours, multiply(colours, of_frames(gains))), of_frames(offsets));
}

Value ExposureCorrection::mean_square(Graph& graph) const {
  const auto square = [&](const char* name) {
    const Value learned = store_.value(graph, name);
    return mean(multiply(learned, learned));
  };
  return add(square(gains), square(offsets));
}

Capture ExposureCorrection::corrected(const Capture& capture) const {
  const std::vector<float> gain = store_.read(gains), offset = store_.read(offsets);
  Capture result = capture;
  for (std::size_t i = 0; i < result.frames.size(); ++i) {
    Exposure& exposure = result.frames[i].exposure;
    const Eigen::Array3d before = exposure.gain;
    for (const auto& [row, share] : capture.training_rows(static_cast<int>(i)))
      for (int c = 0; c < 3; ++c) {
        exposure.gain[c] += share * before[c] * gain[3 * row + c];
        exposure.offset[c] += share * before[c] * offset[3 * row + c];
      }
    exposure.gain = exposure.gain.max(least_gain);
  }
  return result;
}

}  // namespace vivant
