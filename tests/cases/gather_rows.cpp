#include <algorithm>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, ids, channels, live ids (-1: all), every how manyth id is negative (0: none)

HostTensor random_ids(const Variation& v, Random& random) {
  HostTensor ids;
  ids.dtype = DType::i32;
  ids.shape = {v.sizes[1], 1};
  for (std::int64_t k = 0; k < v.sizes[1]; ++k)
    ids.data.push_back(
        static_cast<double>(v.sizes[4] > 0 && k % v.sizes[4] == 0 ? -1 : random.integer(v.sizes[0])));
  if (v.attributes.value("ascending", false))
    std::sort(ids.data.begin(), ids.data.end(),
              [](double a, double b) { return (a < 0 ? 1e18 : a) < (b < 0 ? 1e18 : b); });
  return ids;
}

std::vector<HostTensor> matrix_and_ids(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[0], v.sizes[2]}), random_ids(v, random)};
  in[1].live_rows = v.sizes[3];
  return in;
}
std::vector<HostTensor> rows_and_ids(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor({v.sizes[1], v.sizes[2]}), random_ids(v, random)};
  in[0].live_rows = v.sizes[3];
  if (v.sizes[3] >= 0)  // nobody may follow ids behind the live rows
    std::fill(in[1].data.begin() + v.sizes[3], in[1].data.end(), 1e9);
  return in;
}

std::int64_t live_ids(const Variation& v) { return v.sizes[3] < 0 ? v.sizes[1] : v.sizes[3]; }

std::vector<HostTensor> gathered(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor y;
  y.shape = {v.sizes[1], v.sizes[2]};
  for (std::int64_t k = 0; k < live_ids(v); ++k)
    for (std::int64_t c = 0; c < v.sizes[2]; ++c) {
      const auto id = static_cast<std::int64_t>(in[1].data[k]);
      y.data.push_back(id < 0 ? 0 : in[0].data[id * v.sizes[2] + c]);
    }
  return {y};
}

std::vector<HostTensor> scattered(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor y;
  y.shape = {v.sizes[0], v.sizes[2]};
  y.data.resize(v.sizes[0] * v.sizes[2]);
  for (std::int64_t k = 0; k < live_ids(v); ++k)
    for (std::int64_t c = 0; in[1].data[k] >= 0 && c < v.sizes[2]; ++c)
      y.data[static_cast<std::int64_t>(in[1].data[k]) * v.sizes[2] + c] += in[0].data[k * v.sizes[2] + c];
  return {y};
}

double bytes(const Variation& v) { return 8.0 * static_cast<double>(v.sizes[1] * v.sizes[2]); }

const Register register_gather(OpCase{
    .op = "gather_rows",
    .variations = {{{1, 1, 1, -1, 0}},
                   {{11, 1100, 16, 1050, 7}},
                   {{70, 50, 16, -1, 5}, {{"ascending", true}}}},
    .inputs = matrix_and_ids,
    .reference = gathered,
    .benchmark = {{2097152, 400000, 32, -1, 0}, {{"ascending", true}}},
    .bytes = bytes,
});
const Register register_scatter(OpCase{
    .op = "scatter_rows",
    .variations = {{{13, 1030, 16, -1, 9}, {{"rows", 13}}},
                   {{90, 66, 16, 60, 4}, {{"rows", 90}, {"ascending", true}}}},
    .inputs = rows_and_ids,
    .reference = scattered,
    .benchmark = {{4096, 400000, 32, -1, 0}, {{"rows", 4096}, {"ascending", true}}},
    .flops = [](const Variation& v) { return static_cast<double>(v.sizes[1] * v.sizes[2]); },
    .bytes = bytes,
});

}  // namespace
}  // namespace vivant::cases
