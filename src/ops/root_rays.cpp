#include "vivant/graph/launch.hpp"
#include "vivant/ops/human_samples.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

struct RootRays final : Op {
  explicit RootRays(const Eigen::Vector3d& root) : root(root) {}
  std::string_view name() const override { return "root_rays"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape& origins = in[0].shape;
    if (origins.rank() != 2 || origins[1] != 3 || in[1].shape != origins)
      fail("[root_rays] origins {} and directions {} are not both [R, 3]", origins.text(),
           in[1].shape.text());
    if (in[2].shape.rank() != 2 || in[2].shape[1] != 12)
      fail("[root_rays] transforms {} are not [J, 12]", in[2].shape.text());
    return {{DType::real, {origins[0], 6}, in[0].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& origins = launch.in(0);
    launch.kernel("root_rays.cl", "root_rays")
        .args(origins, launch.in(1), launch.in(2), launch.out(), root.x(), root.y(), root.z(), origins[0],
              launch.count_of(origins))
        .run({static_cast<std::size_t>(origins[0]), 1, 1}, {64, 1, 1});
  }
  Values gradient(const GradientRequest&) const override { return Values(3); }
  const Eigen::Vector3d root;
};

const RegisterOp registration({
    .name = "root_rays",
    .summary = "rays in the frame of the posed root joint",
    .inputs = {{"origins", "[R, 3]"}, {"directions", "[R, 3]"}, {"transforms", "[J, 12]"}},
    .outputs = {{"rays", "[R, 6]"}},
    .attributes = {{"x", 0.0, "rest position of the root, metres"},
                   {"y", 0.0, "the same"},
                   {"z", 0.0, "the same"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {root_rays(in[0], in[1], in[2], {a.number("x"), a.number("y"), a.number("z")})};
    },
});

}  // namespace

Value root_rays(Value origins, Value directions, Value transforms, const Eigen::Vector3d& root) {
  return origins.graph->record_one(RootRays(root), {origins, directions, transforms});
}

}  // namespace vivant
