#pragma once
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "vivant/data/camera.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/model/baked_scene.hpp"

namespace vivant {

/// A rendered picture: linear outputs of the fields, not clamped.
struct RenderedView {
  int width = 0, height = 0;
  std::vector<float> pixels;  ///< [H, W, C]: colours, or another Output
  std::vector<float> alpha;   ///< [H, W]
  std::vector<float> depth;   ///< [H, W], along the ray, of the surface, see peak_depth

  /// Colours as CV_8UC3 RGB, clamped and rounded.
  cv::Mat rgb8() const;
};

/// Renders the background from any camera: planes are baked once, then rays go through in tiles of one size.
class SceneRenderer {
 public:
  struct Options {
    std::int64_t tile_rays = 4096;
    double weight_threshold = 1e-4;  ///< samples that weigh less are left out; 0: none
    Output output = Output::colour;
  };
  SceneRenderer(Device& device, const SceneModel& scene, Options options);
  RenderedView render(const Camera& camera);

 private:
  void build(int width, int height);

  Device& device_;
  const SceneModel& scene_;
  Options options_;
  BakedScene baked_;
  int width_ = 0, height_ = 0;  // of the graph below
  std::int64_t tile_ = 0;       // rays of a tile: small pictures have small ones
  std::unique_ptr<Graph> graph_;
  Value camera_, pixels_, output_, alpha_, depth_, overflow_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace vivant
