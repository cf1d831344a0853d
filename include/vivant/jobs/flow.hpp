#pragma once
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"

namespace vivant {

// Optical flow between two pictures: CV_32FC2, the pixel at p of the first one is at p + flow(p) in the
// second (pixels); NaN where nothing is known.

/// By OpenCV's DIS (preset medium) on the luma of CV_8UC3 RGB pictures.
cv::Mat dis_flow(const cv::Mat& from, const cv::Mat& to);

/// A rendered view whose geometry is known.
struct SurfaceView {
  Camera camera;
  cv::Mat depth;   ///< CV_32FC1 along the ray, in the cameras' unit; 0 where nothing is known
  cv::Mat person;  ///< CV_32FC1, the person's share of each pixel; empty without a person
  std::vector<RigidTransform> joints = {};  ///< of the posed body, in metres; empty without a person
};

/// The flow between rendered views: the scene stands still, and a pixel of the person (share above 1/2) moves
/// with the skinning of the vertex of the posed body that is nearest to it.
class SurfaceFlow {
 public:
  /// `body` may be null when no view has a person; it must outlive this.
  SurfaceFlow(const Body* body, double units_per_metre) : body_(body), units_(units_per_metre) {}
  cv::Mat flow(const SurfaceView& from, const SurfaceView& to) const;
  /// The point that each pixel shows, CV_32FC3 in the cameras' unit; NaN where nothing is known. The person's
  /// points are where they were in the body's rest pose, shifted by `rest_apart` along x: apart from the
  /// scene.
  cv::Mat rest_points(const SurfaceView& view) const;
  static constexpr double rest_apart = 100;  // metres

 private:
  const Body* body_;
  double units_;
};

/// Where the flow can be trusted, CV_8UC1 of 0 and 255 (Lai et al. 2018, after Ruder et al. 2016): p +
/// forward(p) is inside of the picture, |f + b|^2 <= 0.01 (|f|^2 + |b|^2) + 0.5 for the backward flow b found
/// there (else the pixel is hidden), and |grad f|^2 <= 0.01 |f|^2 + 0.002 (else it lies on the border of
/// something that moves).
cv::Mat visible_pixels(const cv::Mat& forward, const cv::Mat& backward);

/// The second picture (CV_8UC3 or CV_32FC3) seen from the first: its colours at p + flow(p).
cv::Mat warped(const cv::Mat& second, const cv::Mat& flow, cv::InterpolationFlags how = cv::INTER_LINEAR);

}  // namespace vivant
