#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// The encoded voxels of the box [-1, 1]^3 averaged on three planes, in closed
/// form: [3, size, size, D], D = 3 (1 + 2 L), planes as in triplane_sample, channels as in
/// positional_encoding. With `occupied` points [P, 3], the centres of occupied voxels, D + 1 + D channels:
/// then the occupancy and the average over occupied voxels alone follow. No gradient: it depends on nothing
/// that is trained.
Value triplane_encoding(Graph& graph, std::int64_t size, int frequencies, Value occupied = {});

/// Channels of the result.
std::int64_t triplane_encoding_channels(int frequencies, bool occupied);

}  // namespace vivant
