#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  HostTensor weight = random.tensor({v.sizes[0], v.sizes[1]}, 0, 1);
  weight.differentiable = false;
  return {weight};
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t capacity = v.attributes.at("capacity").get<std::int64_t>();
  const double threshold = v.attributes.at("threshold").get<double>();
  HostTensor ids, rows, count, overflow;
  ids.dtype = rows.dtype = count.dtype = overflow.dtype = DType::i32;
  ids.shape = rows.shape = {capacity};
  count.shape = overflow.shape = {1};
  std::int64_t total = 0;
  for (std::size_t i = 0; i < in[0].data.size(); ++i) {
    if (in[0].data[i] <= threshold) continue;
    if (total++ >= capacity) continue;
    ids.data.push_back(static_cast<double>(i));
    rows.data.push_back(static_cast<double>(static_cast<std::int64_t>(i) / v.sizes[1]));
  }
  ids.data.resize(capacity, -1);
  rows.data.resize(capacity, -1);
  count.data = {static_cast<double>(std::min(total, capacity))};
  overflow.data = {total > capacity ? 1.0 : 0.0};
  return {ids, rows, count, overflow};
}

const Register registration(OpCase{
    .op = "compact",
    .variations = {{{1, 1}, {{"threshold", 0.0}, {"capacity", 3}}},
                   {{1023, 1}, {{"threshold", 2.0}, {"capacity", 5}}},
                   {{3079, 1}, {{"threshold", 0.7}, {"capacity", 2000}}},
                   {{683, 3}, {{"threshold", 0.25}, {"capacity", 700}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{8192, 128}, {{"threshold", 0.9}, {"capacity", 1 << 18}}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1]); },
    .bytes = [](const Variation& v) { return 8.0 * static_cast<double>(v.sizes[0] * v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
