#pragma once
#include <memory>
#include <vector>

#include "vivant/model/human_model.hpp"
#include "vivant/ops/random.hpp"

namespace vivant {

/// Points of the canonical box with their signed distances to the body, made once and drawn from in every
/// step: for the losses that look at the whole box and not at rays.
class CanonicalPoints {
 public:
  static constexpr std::int64_t line_points = 48;

  struct Points {
    Value points;           ///< [N, 3] metres
    Value signed_distance;  ///< [N, 1]
  };
  struct Lines {
    Points points;  ///< of line_points points on each line
    Value lengths;  ///< [lines, line_points] metres between neighbours
  };
  struct SurfacePairs {
    Value a, b;  ///< [N, 3] points near the surface, about 2 cm apart on each axis
  };

  CanonicalPoints(Device& device, const HumanModel& model, std::uint64_t seed);

  /// Random points of the box.
  Points box(Graph& graph, std::int64_t count, const RandomKey& key) const;
  /// Lines between two random points of the box.
  Lines lines(Graph& graph, std::int64_t count, const RandomKey& key) const;
  SurfacePairs surface(Graph& graph, std::int64_t count, const RandomKey& key) const;

 private:
  std::shared_ptr<Buffer> points_, distances_, line_points_, line_distances_, line_lengths_, pairs_;
};

/// Signed distances in metres of points [N, 3] to the canonical body, at most `most` away.
std::vector<float> canonical_distances(Device& device, const BodyModel& body,
                                       const std::vector<float>& points, double most);

}  // namespace vivant
