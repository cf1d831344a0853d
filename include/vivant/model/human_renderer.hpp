#pragma once
#include <memory>
#include <opencv2/core.hpp>

#include "vivant/graph/executor.hpp"
#include "vivant/model/human_model.hpp"
#include "vivant/ops/rays.hpp"

namespace vivant {

/// How the person is in one picture.
struct PersonState {
  Pose pose;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  HumanModel::CodeRow codes;
};

/// The person as in frame `frame` of the capture: with the frame's own codes when it was trained on, else
/// with those of the nearest trained frames before and after, mixed by distance. Rows of the codes are
/// `capture.training_frames()`.
PersonState captured_state(const HumanModel& model, const Capture& capture, int frame);

/// The inputs of a graph that renders the person in any pose.
class PersonInputs {
 public:
  PersonInputs(Graph& graph, const HumanModel& model);
  /// Traces rays afresh and asks the field. `view_direction` false leaves the direction out: what was learned
  /// of directions in the poses of the training says little about others.
  HumanFieldSamples sample(Graph& graph, Value planes, const Rays& rays, const TraceOptions& trace,
                           std::int64_t capacity, bool view_direction);
  void write(Executor& executor, const PersonState& state) const;
  /// i32 [1]: 1 when the samples did not fit into the capacity.
  Value overflow() const { return overflow_; }

 private:
  const HumanModel& model_;
  Value joints_, overflow_;
  FrameCodes codes_;
};

/// A picture of the person alone: a window of the image, empty elsewhere.
struct PersonView {
  PixelWindow window;
  std::vector<float> rgb;    ///< [h, w, 3] premultiplied with alpha, not clamped
  std::vector<float> alpha;  ///< [h, w]
  std::vector<float> depth;  ///< [h, w] expected depth along the ray, 0 where alpha is 0

  /// Puts the person over a picture, CV_8UC3 RGB.
  void draw_over(cv::Mat& picture) const;
};

/// Renders the person alone from any camera in any pose. Planes are baked once.
class HumanRenderer {
 public:
  struct Options {
    double step = 0.0075;     ///< metres between samples
    double threshold = 0.08;  ///< metres: samples farther from the body are empty
    std::int64_t tile_rays = 2048;
    bool view_direction = true;
  };
  HumanRenderer(Device& device, const HumanModel& model, const Options& options);
  PersonView render(const Camera& camera, const PersonState& state);

 private:
  void build(int width, int height);

  Device& device_;
  const HumanModel& model_;
  Options options_;
  std::shared_ptr<Buffer> planes_;
  Shape planes_shape_;
  std::int64_t samples_per_ray_ = 128, capacity_;
  int width_ = 0, height_ = 0;  // of the graph below
  std::unique_ptr<Graph> graph_;
  std::unique_ptr<PersonInputs> person_;
  Value camera_, pixels_, rgb_, alpha_, depth_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
