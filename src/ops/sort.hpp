#pragma once
#include "vivant/graph/launch.hpp"

namespace vivant {

/// Memory of a sort of `lists` lists of `n` keys: two buffers of keys, two of places, and the counts.
TensorTypes sort_workspaces(std::int64_t lists, std::int64_t n);

struct Sorted {
  Tensor keys, places;  ///< [lists, n]: ascending keys, and where each stood in its list
};

/// Sorts the first `lists` lists of workspaces[first] ascending, stably: keys in [0, end). The workspaces are
/// those of sort_workspaces; the result lies in two of them.
Sorted sort(Launch& launch, int first_workspace, std::int64_t lists, std::int64_t end);

}  // namespace vivant
