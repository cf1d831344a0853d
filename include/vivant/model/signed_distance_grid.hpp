#pragma once
#include <memory>

#include "vivant/model/body_model.hpp"

namespace vivant {

/// The signed distance to the canonical body over its box, precomputed: labels random points of the box
/// (L_smpl) for the price of a trilinear sample. Between nodes it is off by at most a fraction of the
/// spacing, where the surface bends.
class SignedDistanceGrid {
 public:
  /// Nodes are at most `spacing` metres apart on each axis.
  SignedDistanceGrid(Device& device, const BodyModel& body, double spacing = 0.025);

  /// Metres, negative inside: points [N, 3] -> [N, 1].
  Value sample(Graph& graph, Value points) const;
  const Shape& shape() const { return shape_; }

 private:
  Box box_;
  Shape shape_;  // [D, H, W]: z, y, x
  std::shared_ptr<Buffer> distances_;
};

}  // namespace vivant
