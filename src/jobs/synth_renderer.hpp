#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "synth_person.hpp"
#include "synth_room.hpp"
#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"

namespace vivant::synth {

/// What a camera without lens distortion sees of a mesh: the nearest triangle at every pixel centre.
struct Visibility {
  int width = 0;
  int height = 0;
  std::vector<int> triangle;  ///< [height * width] index, -1 where there is none
  std::vector<float>
      inverse_depth;  ///< [height * width] 1/metres along the optical axis, 0 where there is none
};

/// Draws triangles into a depth buffer; those that reach behind the camera are left out.
Visibility rasterise(const Camera& camera, std::span<const Eigen::Vector3d> vertices,
                     std::span<const Eigen::Vector3i> triangles);

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
