#pragma once
#include <memory>

#include "vivant/model/field.hpp"

namespace vivant {

/// The planes of a field, computed once: they depend on the parameters alone. Holds what they were when it
/// was made.
class BakedPlanes {
 public:
  BakedPlanes(Device& device, const Field& field);
  /// As a value of a graph; absent for a field without planes.
  Value value(Graph& graph) const;

 private:
  std::string name_;
  Shape shape_;
  std::shared_ptr<Buffer> buffer_;
};

}  // namespace vivant
