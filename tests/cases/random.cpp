#include "cases/op_case.hpp"
#include "vivant/ops/philox.hpp"

namespace vivant::cases {
namespace {

// sizes: seed, step, elements of the list

HostTensor integers(Shape shape, std::vector<double> data) {
  HostTensor tensor;
  tensor.dtype = DType::i32;
  tensor.shape = std::move(shape);
  tensor.data = std::move(data);
  return tensor;
}

std::vector<HostTensor> key(const Variation& v, Random&) {
  return {integers({1}, {static_cast<double>(v.sizes[0])}), integers({1}, {static_cast<double>(v.sizes[1])})};
}

std::vector<HostTensor> key_and_list(const Variation& v, Random& random) {
  std::vector<HostTensor> in = key(v, random);
  std::vector<double> list(v.sizes[2]);
  for (double& x : list) x = static_cast<double>(random.integer(1000000));
  in.push_back(integers({v.sizes[2]}, list));
  return in;
}

std::uint32_t word(const Variation& v, std::size_t index) {
  return random_word(static_cast<std::uint32_t>(v.sizes[0]), static_cast<std::uint32_t>(v.sizes[1]),
                     v.attributes.value("stream", 0u), static_cast<std::uint32_t>(index));
}

std::vector<HostTensor> uniform(const Variation& v, const std::vector<HostTensor>&) {
  HostTensor y;
  y.shape = {v.attributes["elements"].get<std::int64_t>()};
  for (std::int64_t i = 0; i < y.shape[0]; ++i) y.data.push_back(unit_interval(word(v, i)));
  return {y};
}

std::vector<HostTensor> below(const Variation& v, const std::vector<HostTensor>& in) {
  const bool list = in.size() == 3;
  const std::int64_t elements = v.attributes[list ? "number" : "elements"];
  const auto end = list ? static_cast<std::uint32_t>(v.sizes[2]) : v.attributes["end"].get<std::uint32_t>();
  std::vector<double> numbers;
  for (std::int64_t i = 0; i < elements; ++i) {
    const std::uint32_t number = integer_below(word(v, i), end);
    numbers.push_back(list ? in[2].data[number] : number);
  }
  return {integers({elements}, numbers)};
}

const Register register_uniform(OpCase{
    .op = "random_uniform",
    .variations = {{{0, 0}, {{"elements", 1}}}, {{-5, 123456}, {{"elements", 1003}, {"stream", 7}}}},
    .inputs = key,
    .reference = uniform,
    .tolerance = 0,
    .benchmark = {{1, 2}, {{"elements", 1 << 21}}},
    .bytes = [](const Variation&) { return 4.0 * (1 << 21); },
});
const Register register_integers(OpCase{
    .op = "random_integers",
    .variations = {{{3, 4}, {{"elements", 333}, {"end", 1000000007}, {"stream", 2}}}},
    .inputs = key,
    .reference = below,
    .benchmark = {{1, 2}, {{"elements", 1 << 21}, {"end", 640}}},
    .bytes = [](const Variation&) { return 4.0 * (1 << 21); },
});
const Register register_pick(OpCase{
    .op = "pick",
    .variations = {{{3, 4, 1}, {{"number", 3}}}, {{3, 5, 97}, {{"number", 130}, {"stream", 1}}}},
    .inputs = key_and_list,
    .reference = below,
    .benchmark = {{1, 2, 1000000}, {{"number", 4096}}},
    .bytes = [](const Variation&) { return 8.0 * 4096; },
});

}  // namespace
}  // namespace vivant::cases
