#include "vivant/ops/body_skinning.hpp"

#include "ops/partials.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr std::array<std::size_t, 3> row_group{64, 1, 1};
std::array<std::size_t, 3> row_items(const Tensor& x) { return {static_cast<std::size_t>(x[0]), 1, 1}; }

struct SkinningRestGradient final : Op {
  std::string_view name() const override { return "skinning_rest_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[1]}; }
  void launch(Launch& launch) const override {
    launch.kernel("body_skinning.cl", "skinning_rest_gradient")
        .args(launch.in(0), launch.in(1), launch.out(), launch.out()[0])
        .run(row_items(launch.out()), row_group);
  }
};

/// Inputs: rest, transforms (for their shape), joints, weights, grad_posed, grad_blended.
struct SkinningTransformGradient final : Op {
  std::string_view name() const override { return "skinning_transform_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[1]}; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real, {chunks_of(in[0].shape[0], 128), in[1].shape.elements()}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &rest = launch.in(0), &joints = launch.in(2), &partial = launch.workspace();
    const std::int64_t entries = launch.gpu() ? 1 : 12;
    launch.kernel("body_skinning.cl", "skinning_transform_partials", {{"ENTRIES", entries}})
        .args(rest, joints, launch.in(3), launch.in(4), launch.in(5), partial, rest[0], joints[1],
              launch.out()[0], chunk_length(rest[0], 128))
        .run({static_cast<std::size_t>(partial[0]), static_cast<std::size_t>(12 / entries), 1}, {1, 1, 1});
    reduce_partials(launch, partial, launch.out(), partial[0], partial[1]);
  }
};

struct BodySkinning final : Op {
  std::string_view name() const override { return "body_skinning"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &rest = in[0].shape, &joints = in[2].shape;
    if (rest.rank() != 2 || rest[1] != 3)
      fail("[body_skinning] rest vertices {} are not [V, 3]", rest.text());
    if (in[1].shape.rank() != 2 || in[1].shape[1] != 12)
      fail("[body_skinning] transforms {} are not [J, 12]", in[1].shape.text());
    if (joints.rank() != 2 || joints[0] != rest[0] || in[2].dtype != DType::i32)
      fail("[body_skinning] joints are {} {}, not i32 [{}, K]", name_of(in[2].dtype), joints.text(), rest[0]);
    if (in[3].shape != joints)
      fail("[body_skinning] weights {} do not fit joints {}", in[3].shape.text(), joints.text());
    return {{DType::real, rest}, {DType::real, {rest[0], 12}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &rest = launch.in(0), &joints = launch.in(2);
    launch.kernel("body_skinning.cl", "body_skinning", {{"ENTRIES", launch.gpu() ? 1 : 12}})
        .args(rest, launch.in(1), joints, launch.in(3), launch.out(0), launch.out(1), rest[0], joints[1])
        .run(row_items(rest), row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    const Values& in = request.in;
    Values grads(4);
    if (request.needed[0])
      grads[0] = request.graph.record_one(SkinningRestGradient(), {request.out[1], request.grad(0)});
    if (request.needed[1])
      grads[1] = request.graph.record_one(SkinningTransformGradient(),
                                          {in[0], in[1], in[2], in[3], request.grad(0), request.grad(1)});
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[0].shape[0]) * (24.0 * static_cast<double>(in[2].shape[1]) + 18);
  }
};

/// Both gradients of compose_transforms at once.
struct ComposeGradient final : Op {
  std::string_view name() const override { return "compose_transforms_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0], in[1]}; }
  void launch(Launch& launch) const override {
    launch.kernel("body_skinning.cl", "compose_gradient")
        .args(launch.in(0), launch.in(1), launch.in(2), launch.out(0), launch.out(1), launch.in(0)[0])
        .run(row_items(launch.in(0)), row_group);
  }
};

struct ComposeTransforms final : Op {
  std::string_view name() const override { return "compose_transforms"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rank() != 2 || in[0].shape[1] != 12 || in[1].shape != in[0].shape)
      fail("[compose_transforms] {} and {} are not both [N, 12]", in[0].shape.text(), in[1].shape.text());
    return {in[0]};
  }
  void launch(Launch& launch) const override {
    launch.kernel("body_skinning.cl", "compose_transforms")
        .args(launch.in(0), launch.in(1), launch.out(), launch.out()[0])
        .run(row_items(launch.out()), row_group);
  }
  Values gradient(const GradientRequest& request) const override {
    return request.graph.record(std::make_shared<ComposeGradient>(),
                                {request.in[0], request.in[1], request.grad()});
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 63.0 * static_cast<double>(in[0].shape[0]);
  }
};

const RegisterOp register_body_skinning({
    .name = "body_skinning",
    .summary = "linear blend skinning of a mesh by joint transforms",
    .inputs = {{"rest", "[V, 3]"},
               {"transforms", "[J, 12]"},
               {"joints", "[V, K]", DType::i32},
               {"weights", "[V, K]"}},
    .outputs = {{"vertices", "[V, 3]"}, {"vertex_transforms", "[V, 12]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const SkinnedBody body = body_skinning(in[0], in[1], in[2], in[3]);
      return {body.vertices, body.transforms};
    },
});
const RegisterOp register_compose_transforms({
    .name = "compose_transforms",
    .summary = "affine maps a after b, row by row",
    .inputs = {{"a", "[N, 12]"}, {"b", "[N, 12]"}},
    .outputs = {{"y", "[N, 12]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {compose_transforms(in[0], in[1])};
    },
});

}  // namespace

SkinnedBody body_skinning(Value rest, Value transforms, Value joints, Value weights) {
  const Values out =
      rest.graph->record(std::make_shared<BodySkinning>(), {rest, transforms, joints, weights});
  return {out[0], out[1]};
}

Value compose_transforms(Value a, Value b) { return a.graph->record_one(ComposeTransforms(), {a, b}); }

}  // namespace vivant
