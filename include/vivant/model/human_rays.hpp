#pragma once
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "vivant/model/human_sample_pool.hpp"

namespace vivant {

/// The box of mask and posed body in a picture, `border` pixels larger, within the picture; empty when both
/// are out of sight.
cv::Rect person_box(const cv::Mat& mask, const Camera& camera, const std::vector<Eigen::Vector3d>& posed,
                    int border);

struct HumanRayOptions {
  double border = 0.04;      ///< image heights around the box of mask and posed body
  double mask_softness = 0;  ///< image heights that masks are off by: the standard deviation of their blur
  int unseen_views = 0;      ///< views of what no picture shows of the body, in made up colours
  PoolOptions pool;
};

/// The rays that train the person, on the device: all pixels of a box around the person in every frame, each
/// with what it should see and its samples near the posed body; and those of unseen_surface.hpp, if there are
/// any. What these should see is made up, so that it must not tell what a frame's pose is off by: they name
/// the rows of with_constant_copies().
class HumanRays {
 public:
  /// `frames`: indices into capture.frames; their positions are the rows of the frame codes. `backgrounds`:
  /// the picture behind the person of each of them, CV_8UC3 RGB, usually the rendered scene.
  HumanRays(Device& device, const BodyModel& body, const Capture& capture, const std::vector<int>& frames,
            const std::vector<cv::Mat>& backgrounds, const HumanRayOptions& options);

  const HumanSamplePool& samples() const { return pool_; }
  bool has_unseen_views() const { return has_unseen_views_; }
  Value colours(Graph& graph) const;      ///< u8 [rays, 3]
  Value backgrounds(Graph& graph) const;  ///< u8 [rays, 3]
  Value masks(Graph& graph) const;        ///< u8 [rays, 1], 255 on the person, between at its border
  /// i32 [L] what to draw from: every ray once, and rays on the mask as often again, so that half of a random
  /// draw lies on the person.
  Value drawn(Graph& graph) const;
  /// The mean number of samples over the draws.
  double mean_samples() const { return mean_samples_; }

 private:
  HumanSamplePool pool_;
  bool has_unseen_views_ = false;
  std::int64_t drawn_count_ = 0;
  double mean_samples_ = 0;
  std::shared_ptr<Buffer> colours_, backgrounds_, masks_, drawn_;
};

}  // namespace vivant
