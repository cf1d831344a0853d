#pragma once
#include <cstdint>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// What random numbers depend on, and nothing else: `seed` and `step`, i32 [1], which the host may set
/// between runs, and `stream`, a number of its own for every use in a graph. See philox.hpp for the numbers.
struct RandomKey {
  Value seed, step;
  int stream = 0;
};

/// Uniform numbers in [0, 1).
Value random_uniform(Shape shape, const RandomKey& key);
/// Uniform integers in [0, end), i32.
Value random_integers(Shape shape, std::int64_t end, const RandomKey& key);
/// `number` random entries of an i32 list [L], each drawn independently: the training rays of a step.
Value pick(Value list, std::int64_t number, const RandomKey& key);

}  // namespace vivant
