#include "vivant/ops/triplane_encoding.hpp"

#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct TriplaneEncoding final : Op {
  TriplaneEncoding(std::int64_t size, int frequencies) : size(size), frequencies(frequencies) {}
  std::string_view name() const override { return "triplane_encoding"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& points = in[0].shape;
    if (points.rank() > 0 && (points.rank() != 2 || points[1] != 3))
      fail("[triplane_encoding] occupied voxels are {}, not [P, 3]", points.text());
    return {{DType::real, {3, size, size, triplane_encoding_channels(frequencies, points.rank() > 0)}}};
  }
  void launch(Launch& launch) const override {
    const Tensor& points = launch.in(0);
    launch.kernel("triplane_encoding.cl", "triplane_encoding", {{"OCCUPIED", points ? 1 : 0}})
        .args(points, launch.out(), size, frequencies, points ? points[0] : 0)
        .run({static_cast<std::size_t>(size), 3, 1}, {1, 1, 1});
  }
  Values gradient(const GradientRequest&) const override { return {Value{}}; }
  const std::int64_t size;
  const int frequencies;
};

const RegisterOp registration({
    .name = "triplane_encoding",
    .summary = "encoded voxels averaged on the planes xy, xz and yz, in closed form",
    .inputs = {{.name = "occupied", .shape = "[P, 3]", .optional = true}},
    .outputs = {{"y", "[3, size, size, D] or [3, size, size, 2 D + 1]"}},
    .attributes = {{"size", 64, "side of the planes"}, {"frequencies", 6, "octaves of the encoding"}},
    .build = [](Graph& graph, const Values& in, const Attributes& a) -> Values {
      return {triplane_encoding(graph, a.integer("size"), static_cast<int>(a.integer("frequencies")), in[0])};
    },
});

}  // namespace

std::int64_t triplane_encoding_channels(int frequencies, bool occupied) {
  const std::int64_t width = 3 * (1 + 2 * frequencies);
  return occupied ? 2 * width + 1 : width;
}

Value triplane_encoding(Graph& graph, std::int64_t size, int frequencies, Value occupied) {
  return graph.record_one(TriplaneEncoding(size, frequencies), {occupied});
}

}  // namespace vivant
