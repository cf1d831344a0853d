#pragma once
#include <opencv2/core.hpp>

#include "synth_person.hpp"
#include "synth_room.hpp"
#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"
#include "vivant/data/rasterise.hpp"

namespace vivant::synth {

struct Picture {
  cv::Mat image;  ///< CV_8UC3, RGB
  cv::Mat mask;   ///< CV_8UC1, 255 where the person covers at least half of the pixel
};

/// Pictures of a person in a room: diffuse shading by one lamp with soft shadows and by indirect light, 16
/// samples a pixel. The same input gives the same bytes, with any number of threads.
class Renderer {
 public:
  /// Keeps references to all three.
  Renderer(const Room& room, const Body& body, const Wardrobe& wardrobe);

  Picture render(const Camera& camera, const Pose& pose, const Eigen::Vector3d& translation) const;

 private:
  const Room& room_;
  const Body& body_;
  const Wardrobe& wardrobe_;
};

/// The colour, linear, of the empty room along a ray, evenly lit; used for sparse points.
Colour flat_colour(const Room& room, const RoomHit& hit);

/// Linear light to sRGB 0..255.
cv::Vec3b to_srgb(const Colour& colour);

}  // namespace vivant::synth
