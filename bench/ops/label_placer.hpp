#pragma once
#include <vector>

namespace vivant::bench {

/// A rectangle of a picture, in pixels.
struct Box {
  double left = 0, top = 0, width = 0, height = 0;

  bool overlaps(const Box& other) const {
    return left < other.left + other.width && other.left < left + width && top < other.top + other.height &&
           other.top < top + height;
  }
  bool inside(const Box& frame) const {
    return left >= frame.left && top >= frame.top && left + width <= frame.left + frame.width &&
           top + height <= frame.top + frame.height;
  }
};

/// Finds places for labels beside their points, so that none lies on another.
class LabelPlacer {
 public:
  explicit LabelPlacer(const Box& frame) : frame_(frame) {}

  /// No label may come here.
  void block(const Box& box) { taken_.push_back(box); }
  /// A free place of this size inside of the frame, as near to (x, y) as there is one; beside the point when
  /// there is none.
  Box place(double x, double y, double width, double height);

 private:
  Box frame_;
  std::vector<Box> taken_;
};

}  // namespace vivant::bench
