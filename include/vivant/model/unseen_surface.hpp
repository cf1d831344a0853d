#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "vivant/data/capture.hpp"

namespace vivant {

/// What the pictures of a person say of the colours of the body's surface.
struct SurfaceColours {
  std::vector<cv::Vec3f> colour;  ///< [V] RGB in 0..255, of unseen vertices that of the nearest ones with one
  std::vector<bool> unseen;       ///< [V] the body hides the vertex from every picture
};

/// The mean colour of every vertex of `body` in the pictures of `frames` that show it from no flat angle,
/// within the mask by more than `error`, the image heights that masks and poses are off by. Where none does,
/// the mean of the four nearest vertices that have one, in the rest pose. What furniture hides counts as
/// seen: its masks say that no person is there. Nothing when no picture shows any of the body within its
/// mask.
std::optional<SurfaceColours> surface_colours(const Body& body, const Capture& capture,
                                              const std::vector<int>& frames, double error);

/// Pixels of a view from another side of the person that show nothing but unseen surface.
struct UnseenView {
  std::size_t row = 0;             ///< whose pose: the position in `frames`
  std::vector<Ray> rays;           ///< [P]
  std::vector<cv::Vec3b> colours;  ///< [P] RGB, made up from what is seen around
};

/// `count` views of evenly chosen frames, each turned further around the person from its frame's camera, a
/// full turn in all; none when surface_colours() says nothing. They keep twice the `error` away from the
/// outline of the posed body, as they know no better than its pose. Trained with them, the person's back has
/// the colours of their sides, not what no training left there. Not in the paper.
std::vector<UnseenView> unseen_views(const Body& body, const Capture& capture, const std::vector<int>& frames,
                                     int count, double error);

}  // namespace vivant
