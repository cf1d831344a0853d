#pragma once
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "vivant/graph/executor.hpp"
#include "vivant/model/baked_scene.hpp"
#include "vivant/model/composite.hpp"
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

/// The person in a pose that was not trained on, with `codes` (HumanModel::mean_codes or zeros).
PersonState novel_state(const Motion& motion, int frame, const HumanModel::CodeRow& codes);

/// The inputs of a graph that renders the person in any pose.
class PersonInputs {
 public:
  PersonInputs(Graph& graph, const HumanModel& model);
  /// Traces rays afresh and asks the field. `capacity`: of all samples; 0: never too small. `view_direction`
  /// false leaves the direction out: what was learned of directions in the poses of the training says little
  /// about others. `light` turns normals into the world that the field was trained in.
  HumanFieldSamples sample(Graph& graph, Value planes, const Rays& rays, const TraceOptions& trace,
                           std::int64_t capacity, bool view_direction, Output output = Output::colour,
                           const Eigen::Matrix3d& light = Eigen::Matrix3d::Identity());
  void write(Executor& executor, const PersonState& state) const;
  /// i32 [1]: 1 when the samples did not fit into the capacity.
  Value overflow() const { return overflow_; }

 private:
  const HumanModel& model_;
  Value joints_, overflow_;
  FrameCodes codes_;
};

/// The window of a picture in which the person is: alone, or with the scene around.
struct PersonView {
  PixelWindow window;
  std::vector<float> pixels;   ///< [h, w, C] not clamped: colours, or another Output; the person alone is
                               ///< premultiplied with alpha
  std::vector<float> alpha;    ///< [h, w] of the person
  std::vector<float> opacity;  ///< [h, w] of person and scene together
  std::vector<float> depth;    ///< [h, w] along the ray, in the cameras' unit, of the surface (peak_depth):
                               ///< the person's where its alpha is above 1/2, else the scene's

  /// For colours: puts the person alone over a picture, CV_8UC3 RGB.
  void draw_over(cv::Mat& picture) const;
};

/// Renders the person from any camera in any pose, alone or in a scene. Planes are baked once.
class HumanRenderer {
 public:
  static constexpr std::int64_t samples_per_ray = 128;  ///< the most; those behind are dropped

  struct Options {
    double step = 0.0075;     ///< metres between samples
    double threshold = 0.12;  ///< metres: samples farther from the body are empty
    std::int64_t tile_rays = 2048;
    bool view_direction = true;
    const SceneModel* scene = nullptr;  ///< absent: the person alone
    double units_per_metre = 1;         ///< of the world that cameras and scene are in; poses are in metres
    /// Turns that world into the one that the person was trained in: the light on them.
    Eigen::Matrix3d light = Eigen::Matrix3d::Identity();
    Intervals intervals = Intervals::own;
    double weight_threshold = 1e-4;  ///< samples that weigh less have no hidden units
    Output output = Output::colour;  ///< hidden units: of the scene, if any, then of the person
  };
  HumanRenderer(Device& device, const HumanModel& model, const Options& options);
  PersonView render(const Camera& camera, const PersonState& state);

 private:
  void build(int width, int height);

  Device& device_;
  const HumanModel& model_;
  Options options_;
  BakedPlanes planes_;
  std::optional<BakedScene> scene_;
  std::int64_t room_ = 48;      // for samples, on the mean of a tile's rays
  int width_ = 0, height_ = 0;  // of the graph below
  std::int64_t tile_ = 0;       // rays of a tile: small pictures have small ones
  std::unique_ptr<Graph> graph_;
  std::unique_ptr<PersonInputs> person_;
  Value camera_, pixels_, output_, alpha_, opacity_, depth_, scene_depth_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
