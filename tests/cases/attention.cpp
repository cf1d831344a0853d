#include <cmath>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

struct Extents {
  explicit Extents(const Variation& v)
      : queries(v.sizes[0]),
        keys(v.sizes[1]),
        inner(v.sizes[2]),
        channels(v.sizes[3]),
        live(v.sizes[4]),
        biased(v.sizes[5] != 0) {}
  std::int64_t queries, keys, inner, channels, live;  // live: live keys, or -1: all
  bool biased;
};

// sizes: queries, keys, channels of both, channels of v, live keys (-1: all), with bias
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const Extents e(v);
  std::vector<HostTensor> in = {random.tensor({e.queries, e.inner}), random.tensor({e.keys, e.inner}),
                                random.tensor({e.keys, e.channels}, 2, 4), random.tensor({e.keys}, 0, 0.5)};
  in[1].live_rows = e.live;
  in[3].absent = !e.biased;
  return in;
}

std::vector<double> unit_rows(const std::vector<double>& x, std::int64_t channels) {
  std::vector<double> y = x;
  for (std::size_t row = 0; row < x.size(); row += channels) {
    double sum = 1e-12;
    for (std::int64_t c = 0; c < channels; ++c) sum += x[row + c] * x[row + c];
    for (std::int64_t c = 0; c < channels; ++c) y[row + c] /= std::sqrt(sum);
  }
  return y;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const Extents e(v);
  const bool cosine = v.attributes.value("cosine", false);
  const double scale = v.attributes.value("scale", 1.0);
  const std::vector<double> q = cosine ? unit_rows(in[0].data, e.inner) : in[0].data;
  const std::vector<double> k = cosine ? unit_rows(in[1].data, e.inner) : in[1].data;
  const std::int64_t live = e.live < 0 ? e.keys : e.live;
  HostTensor mean{.shape = {e.queries, e.channels}, .data = {}}, deviation = mean;
  for (std::int64_t i = 0; i < e.queries; ++i) {
    std::vector<double> weights;
    double total = 0;
    for (std::int64_t j = 0; j < live; ++j) {
      double score = e.biased ? in[3].data[j] : 0;
      for (std::int64_t d = 0; d < e.inner; ++d) score += scale * q[i * e.inner + d] * k[j * e.inner + d];
      weights.push_back(cosine ? score + 1 : std::exp(score));
      total += weights.back();
    }
    for (std::int64_t c = 0; c < e.channels; ++c) {
      double first = 0, variance = 0;
      for (std::int64_t j = 0; j < live; ++j) first += weights[j] / total * in[2].data[j * e.channels + c];
      for (std::int64_t j = 0; j < live; ++j)
        variance += weights[j] / total * std::pow(in[2].data[j * e.channels + c] - first, 2);
      mean.data.push_back(first);
      deviation.data.push_back(std::sqrt(std::max(0.0, variance)));
    }
  }
  return {mean, deviation};
}

const Register registration(OpCase{
    .op = "attention",
    .variations = {{{1, 2, 1, 1, -1, 0}},
                   {{50, 67, 5, 3, -1, 1}, {{"scale", 2.5}}},
                   {{61, 130, 9, 33, 70, 0}},
                   {{49, 64, 8, 16, -1, 0}, {{"cosine", true}}},
                   {{7, 70, 3, 2, 66, 1}, {{"cosine", true}, {"scale", 0.5}}}},
    .inputs = inputs,
    .reference = reference,
    .for_matrix_units = {{{61, 130, 40, 33, 70, 1}},
                         {{70, 97, 64, 64, -1, 0}, {{"scale", 0.3}}},
                         {{65, 70, 20, 48, -1, 1}, {{"cosine", true}}}},
    .benchmark = {{4096, 4096, 256, 256, -1, 0}, {{"scale", 0.1}}},
    .flops =
        [](const Variation& v) {
          const Extents e(v);
          return 2.0 * static_cast<double>(e.queries * e.keys * (e.inner + 2 * e.channels));
        },
    .bytes =
        [](const Variation& v) {
          const Extents e(v);
          return 4.0 * static_cast<double>(e.queries * (e.inner + 2 * e.channels) +
                                           e.keys * (e.inner + e.channels));
        },
});

}  // namespace
}  // namespace vivant::cases
