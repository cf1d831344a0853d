#include <algorithm>
#include <numeric>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// Ascending depths per ray, on a coarse grid so that some are equal.
HostTensor depths(Random& random, std::int64_t rays, std::int64_t samples) {
  HostTensor tensor;
  tensor.shape = {rays, samples};
  tensor.differentiable = false;
  for (std::int64_t r = 0; r < rays; ++r) {
    std::vector<double> row;
    for (std::int64_t s = 0; s < samples; ++s) row.push_back(static_cast<double>(random.integer(40)) / 8);
    std::sort(row.begin(), row.end());
    tensor.data.insert(tensor.data.end(), row.begin(), row.end());
  }
  return tensor;
}

HostTensor order_of(const HostTensor& a, const HostTensor& b) {
  const std::int64_t a_count = a.shape[1], b_count = b.shape[1];
  HostTensor order;
  order.dtype = DType::i32;
  order.shape = {a.shape[0], a_count + b_count};
  for (std::int64_t r = 0; r < a.shape[0]; ++r) {
    std::vector<int> ids(a_count + b_count);
    std::iota(ids.begin(), ids.end(), 0);
    const auto depth = [&](int id) {
      return id < a_count ? a.data[r * a_count + id] : b.data[r * b_count + id - a_count];
    };
    std::stable_sort(ids.begin(), ids.end(), [&](int x, int y) { return depth(x) < depth(y); });
    order.data.insert(order.data.end(), ids.begin(), ids.end());
  }
  return order;
}

const std::vector<Variation> shapes = {{{1, 1, 1}}, {{7, 13, 5}}, {{33, 8, 17}}};  // rays, A, B
const Variation frame = {{16384, 128, 64}};
double all_samples(const Variation& v) { return static_cast<double>(v.sizes[0] * (v.sizes[1] + v.sizes[2])); }

const Register order_case(OpCase{
    .op = "merge_order",
    .variations = shapes,
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      return {depths(random, v.sizes[0], v.sizes[1]), depths(random, v.sizes[0], v.sizes[2])};
    },
    .reference = [](const Variation&, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      return {order_of(in[0], in[1])};
    },
    .benchmark = frame,
    .flops = all_samples,
    .bytes = [](const Variation& v) { return 8 * all_samples(v); },
});

const Register merge_case(OpCase{
    .op = "merge_by",
    .variations = shapes,
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      const HostTensor order =
          order_of(depths(random, v.sizes[0], v.sizes[1]), depths(random, v.sizes[0], v.sizes[2]));
      return {order, random.tensor({v.sizes[0], v.sizes[1]}), random.tensor({v.sizes[0], v.sizes[2]})};
    },
    .reference = [](const Variation& v, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      HostTensor merged;
      merged.shape = in[0].shape;
      for (std::size_t k = 0; k < in[0].data.size(); ++k) {
        const std::int64_t ray = static_cast<std::int64_t>(k) / merged.shape[1], a_count = v.sizes[1];
        const auto from = static_cast<std::int64_t>(in[0].data[k]);
        merged.data.push_back(from < a_count ? in[1].data[ray * a_count + from]
                                             : in[2].data[ray * v.sizes[2] + from - a_count]);
      }
      return {merged};
    },
    .benchmark = frame,
    .flops = all_samples,
    .bytes = [](const Variation& v) { return 12 * all_samples(v); },
});

std::vector<Variation> with_a_count(std::vector<Variation> variations) {
  for (Variation& v : variations) v.attributes = {{"a_count", v.sizes[1]}};
  return variations;
}

const Register split_case(OpCase{
    .op = "split_by",
    .variations = with_a_count(shapes),
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      const HostTensor order =
          order_of(depths(random, v.sizes[0], v.sizes[1]), depths(random, v.sizes[0], v.sizes[2]));
      return {order, random.tensor({v.sizes[0], v.sizes[1] + v.sizes[2]})};
    },
    .reference = [](const Variation& v, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      HostTensor a, b;
      a.shape = {v.sizes[0], v.sizes[1]};
      b.shape = {v.sizes[0], v.sizes[2]};
      a.data.resize(a.shape.elements());
      b.data.resize(b.shape.elements());
      for (std::size_t k = 0; k < in[0].data.size(); ++k) {
        const std::int64_t ray = static_cast<std::int64_t>(k) / in[0].shape[1];
        const auto to = static_cast<std::int64_t>(in[0].data[k]);
        (to < v.sizes[1] ? a.data[ray * v.sizes[1] + to] : b.data[ray * v.sizes[2] + to - v.sizes[1]]) =
            in[1].data[k];
      }
      return {a, b};
    },
    .benchmark = with_a_count({frame}).front(),
    .flops = all_samples,
    .bytes = [](const Variation& v) { return 12 * all_samples(v); },
});

const Register union_case(OpCase{
    .op = "union_deltas",
    .variations = {{{1, 1}}, {{9, 13}}},
    .inputs = [](const Variation& v, Random& random) -> std::vector<HostTensor> {
      HostTensor deltas = random.tensor({v.sizes[0], v.sizes[1]}, 0.1, 1);
      deltas.differentiable = false;
      for (double& x : deltas.data) x = x < 0.3 ? 0 : x;
      return {depths(random, v.sizes[0], v.sizes[1]), deltas};
    },
    .reference = [](const Variation& v, const std::vector<HostTensor>& in) -> std::vector<HostTensor> {
      HostTensor out = in[1];
      const std::int64_t samples = v.sizes[1];
      for (std::int64_t r = 0; r < v.sizes[0]; ++r)
        for (std::int64_t k = 0; k < samples; ++k)
          for (std::int64_t next = k + 1; next < samples && in[1].data[r * samples + k] != 0; ++next)
            if (in[1].data[r * samples + next] != 0) {
              out.data[r * samples + k] = in[0].data[r * samples + next] - in[0].data[r * samples + k];
              break;
            }
      return {out};
    },
    .benchmark = {{16384, 192}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 12.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
