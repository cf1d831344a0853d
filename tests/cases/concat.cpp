#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rows, channels of a, b and c (0: absent)
std::vector<HostTensor> concat_inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in;
  for (int part = 1; part <= 3; ++part) {
    in.push_back(random.tensor({v.sizes[0], v.sizes[part]}));
    in.back().absent = v.sizes[part] == 0;
  }
  return in;
}

std::vector<HostTensor> concat_reference(const Variation& v, const std::vector<HostTensor>& in) {
  HostTensor y;
  y.shape = {v.sizes[0], v.sizes[1] + v.sizes[2] + v.sizes[3]};
  for (std::int64_t row = 0; row < v.sizes[0]; ++row)
    for (int part = 0; part < 3; ++part)
      for (std::int64_t c = 0; c < v.sizes[1 + part]; ++c)
        y.data.push_back(in[part].data[row * v.sizes[1 + part] + c]);
  return {y};
}

const Register register_concat(OpCase{
    .op = "concat",
    .variations = {{{1, 1, 1, 0}}, {{67, 16, 3, 33}}, {{130, 5, 17, 0}}},
    .inputs = concat_inputs,
    .reference = concat_reference,
    .benchmark = {{65536, 64, 64, 0}},
    .bytes =
        [](const Variation& v) {
          return 8.0 * static_cast<double>(v.sizes[0] * (v.sizes[1] + v.sizes[2] + v.sizes[3]));
        },
});

// sizes: the extents of x, live rows (-1: all)
std::vector<HostTensor> slice_inputs(const Variation& v, Random& random) {
  std::vector<HostTensor> in = {random.tensor(Shape({v.sizes.begin(), v.sizes.end() - 1}))};
  in[0].live_rows = v.sizes.back();
  return in;
}

std::vector<HostTensor> slice_reference(const Variation& v, const std::vector<HostTensor>& in) {
  const Shape& x = in[0].shape;
  const int axis = (v.attributes.value("axis", -1) + x.rank()) % x.rank();
  const std::int64_t first = v.attributes.value("first", 0), extent = v.attributes.value("extent", 1);
  std::vector<std::int64_t> extents = x.extents();
  extents[axis] = extent;
  HostTensor y;
  y.shape = Shape(extents);
  std::int64_t inner = 1;
  for (int i = axis + 1; i < x.rank(); ++i) inner *= x[i];
  for (std::int64_t e = 0; e < x.elements(); ++e) {
    const std::int64_t at = e / inner % x[axis];
    const bool live = in[0].live_rows < 0 || e / (x.elements() / x[0]) < in[0].live_rows;
    if (live && at >= first && at < first + extent) y.data.push_back(in[0].data[e]);
  }
  return {y};
}

const Register register_slice(OpCase{
    .op = "slice",
    .variations = {{{70, 37, -1}, {{"first", 3}, {"extent", 20}}},
                   {{70, 5, 33}, {{"first", 4}, {"extent", 1}}},
                   {{11, 7, 5, -1}, {{"axis", 0}, {"first", 2}, {"extent", 9}}},
                   {{5, 11, 3, -1}, {{"axis", 1}, {"first", 10}, {"extent", 1}}}},
    .inputs = slice_inputs,
    .reference = slice_reference,
    .benchmark = {{65536, 128, -1}, {{"first", 64}, {"extent", 64}}},
    .bytes =
        [](const Variation& v) {
          return 8.0 * static_cast<double>(v.sizes[0]) * v.attributes.at("extent").get<double>();
        },
});

}  // namespace
}  // namespace vivant::cases
