#include <algorithm>

#include "cases/image_case.hpp"

namespace vivant::cases {
namespace {

// Every number is far from all others, so that small steps change no maximum.
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = one_image(v, random);
  std::vector<double>& data = in[0].data;
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = 0.01 * static_cast<double>(i) - 1;
  for (std::size_t i = data.size(); i-- > 1;)
    std::swap(data[i], data[random.integer(static_cast<std::int64_t>(i) + 1)]);
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t height = v.sizes[0], width = v.sizes[1], up = v.attributes.value("ceil", false) ? 1 : 0;
  return {make_image({(height + up) / 2, (width + up) / 2, v.sizes[2]},
                     [&](std::int64_t y, std::int64_t x, std::int64_t c) {
                       double largest = pixel(in[0], 2 * y, 2 * x, c);
                       for (std::int64_t i = 2 * y; i < std::min(2 * y + 2, height); ++i)
                         for (std::int64_t j = 2 * x; j < std::min(2 * x + 2, width); ++j)
                           largest = std::max(largest, pixel(in[0], i, j, c));
                       return largest;
                     })};
}

double elements(const Variation& v) { return static_cast<double>(v.sizes[0] * v.sizes[1] * v.sizes[2]); }

const Register registration(OpCase{
    .op = "max_pool2d",
    .variations = {{{2, 2, 1}},
                   {{7, 5, 3}},
                   {{7, 5, 32}, {{"ceil", true}}},
                   {{1, 3, 3}, {{"ceil", true}}},
                   {{6, 8, 16}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{256, 256, 64}},
    .flops = elements,
    .bytes = [](const Variation& v) { return 5 * elements(v); },
});

}  // namespace
}  // namespace vivant::cases
