#include <algorithm>
#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: depth, height, width of the grid, rays, samples. Some points lie outside. Nothing stands near a
// bound, where rounding would decide.
constexpr double threshold = 1e-2;

std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t cells = v.sizes[0] * v.sizes[1] * v.sizes[2], samples = v.sizes[3] * v.sizes[4];
  HostTensor grid = random.tensor({v.sizes[0], v.sizes[1], v.sizes[2], 2}),
             points = random.tensor({samples, 3}, -1.2, 1.2),
             deltas = random.tensor({v.sizes[3], v.sizes[4]}, 0.5, 1);
  for (std::int64_t cell = 0; cell < cells; ++cell) {
    const bool empty = random.uniform() < 0.5;
    grid.data[2 * cell] = empty ? 0 : random.uniform(0, 1.5);
    grid.data[2 * cell + 1] = empty ? random.uniform(0, 0.9 * threshold) : random.uniform(1.5, 3);
  }
  for (double& x : points.data)  // off the borders of cells
    for (std::int64_t axis = 0; axis < 3; ++axis) {
      const double place = (x + 1) / 2 * static_cast<double>(v.sizes[axis]);
      if (std::abs(place - std::round(place)) < 1e-3) x += 0.01;
    }
  for (HostTensor* tensor : {&grid, &points, &deltas}) tensor->differentiable = false;
  return {grid, points, deltas};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t rays = v.sizes[3], samples = v.sizes[4];
  HostTensor rows = fixed_tensor(DType::i32, {rays, samples}),
             ids = fixed_tensor(DType::i32, {rays * samples, 1}), count = fixed_tensor(DType::i32, {1});
  rows.data.assign(rays * samples, -1);
  ids.data.assign(rays * samples, -1);
  std::int64_t row = 0;
  for (std::int64_t ray = 0; ray < rays; ++ray) {
    double passed = 0;
    for (std::int64_t i = ray * samples; i < (ray + 1) * samples; ++i) {
      std::int64_t cell = 0;
      for (int axis = 2; axis >= 0; --axis) {
        const std::int64_t cells = v.sizes[2 - axis];
        const double place = (in[1].data[3 * i + axis] + 1) / 2 * static_cast<double>(cells);
        cell = cell * cells +
               std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(place)), 0, cells - 1);
      }
      const double delta = in[2].data[i];
      if (in[0].data[2 * cell + 1] * delta > threshold && passed < -std::log(threshold)) {
        rows.data[i] = static_cast<double>(row);
        ids.data[row++] = static_cast<double>(i);
      }
      passed += in[0].data[2 * cell] * delta;
    }
  }
  count.data = {static_cast<double>(row)};
  return {rows, ids, count};
}

const Register registration(OpCase{
    .op = "occupied_samples",
    .variations = {{{1, 1, 1, 1, 1}, {{"threshold", threshold}}},
                   {{3, 5, 4, 37, 19}, {{"threshold", threshold}}},
                   {{7, 2, 9, 300, 13}, {{"threshold", threshold}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{64, 64, 64, 4096, 128}, {{"threshold", threshold}}},
    .bytes = [](const Variation& v) { return 4.0 * 7 * static_cast<double>(v.sizes[3] * v.sizes[4]); },
});

}  // namespace
}  // namespace vivant::cases
