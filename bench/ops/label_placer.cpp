#include "bench/ops/label_placer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vivant::bench {

Box LabelPlacer::place(double x, double y, double width, double height) {
  constexpr int directions = 16;
  constexpr double nearest = 9, farthest = 90, step = 3;
  const auto at = [&](double distance, int direction) {
    const double angle = (0.5 - direction) * 2 * std::numbers::pi / directions;
    return Box{x + distance * std::cos(angle) - width / 2, y + distance * std::sin(angle) - height / 2, width,
               height};
  };
  const auto is_free = [&](const Box& box) {
    return box.inside(frame_) &&
           std::none_of(taken_.begin(), taken_.end(), [&](const Box& other) { return box.overlaps(other); });
  };
  Box found = at(nearest, 0);
  for (int i = 0; nearest + i * step < farthest; ++i) {
    int direction = 0;
    while (direction < directions && !is_free(at(nearest + i * step, direction))) ++direction;
    if (direction == directions) continue;
    found = at(nearest + i * step, direction);
    break;
  }
  taken_.push_back(found);
  return found;
}

}  // namespace vivant::bench
