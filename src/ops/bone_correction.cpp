#include "vivant/ops/bone_correction.hpp"

#include "ops/partials.hpp"
#include "vivant/graph/launch.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

enum Input { points, face, barycentric, frame, codes, triangles, joints, weights, centres, grad_e };

constexpr std::int64_t shortest_chunk = 2048, most_chunks = 16;

std::array<std::size_t, 3> row_items(const Tensor& x) { return {static_cast<std::size_t>(x[0]), 1, 1}; }
std::array<std::size_t, 3> row_group(const Launch& launch) {
  return {launch.gpu() ? std::size_t{64} : std::size_t{16}, 1, 1};
}

struct BonePointsGradient final : Op {
  std::string_view name() const override { return "bone_points_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[points]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(points);
    launch.kernel("bone_correction.cl", "bone_points_gradient")
        .args(launch.in(face), launch.in(barycentric), launch.in(frame), launch.in(codes),
              launch.in(triangles), launch.in(joints), launch.in(weights), launch.in(grad_e), launch.out(),
              x[0], launch.in(joints)[1], launch.in(codes)[1], launch.count_of(x))
        .run(row_items(x), row_group(launch));
  }
};

struct BoneCodesGradient final : Op {
  std::string_view name() const override { return "bone_codes_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, in[codes].shape}}; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return {{DType::real,
             {chunks_of(in[points].shape[0], shortest_chunk, most_chunks), in[codes].shape.elements()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(points), &code = launch.in(codes), &partial = launch.workspace();
    const std::int64_t entries = launch.gpu() ? 1 : 6;
    launch.kernel("bone_correction.cl", "bone_codes_partials", {{"ENTRIES", entries}})
        .args(x, launch.in(face), launch.in(barycentric), launch.in(frame), launch.in(triangles),
              launch.in(joints), launch.in(weights), launch.in(centres), launch.in(grad_e), partial, x[0],
              launch.in(joints)[1], code[1], code[0], chunk_length(x[0], shortest_chunk, most_chunks),
              launch.count_of(x))
        .run({static_cast<std::size_t>(partial[0]), static_cast<std::size_t>(6 / entries), 1}, {1, 1, 1});
    reduce_partials(launch, partial, launch.out(), partial[0], partial[1]);
  }
};

struct BoneCorrection final : Op {
  std::string_view name() const override { return "bone_correction"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &x = in[points].shape, &code = in[codes].shape, &skin = in[joints].shape;
    if (x.rank() != 2 || x[1] != 3) fail("[bone_correction] points {} are not [N, 3]", x.text());
    for (const int i : {face, frame})
      if (in[i].dtype != DType::i32 || in[i].shape != Shape{x[0], 1})
        fail("[bone_correction] faces and frames must be i32 [{}, 1], not {} {}", x[0], name_of(in[i].dtype),
             in[i].shape.text());
    if (in[barycentric].shape != x)
      fail("[bone_correction] barycentric weights {} do not fit points {}", in[barycentric].shape.text(),
           x.text());
    if (code.rank() != 3 || code[2] != 6)
      fail("[bone_correction] codes {} are not [frames, J, 6]", code.text());
    if (in[centres].shape != Shape{code[1], 3})
      fail("[bone_correction] centres {} are not [{}, 3]", in[centres].shape.text(), code[1]);
    if (skin.rank() != 2 || in[weights].shape != skin)
      fail("[bone_correction] joints {} and weights {} are not both [V, K]", skin.text(),
           in[weights].shape.text());
    return {in[points]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(points);
    launch.kernel("bone_correction.cl", "bone_correction")
        .args(x, launch.in(face), launch.in(barycentric), launch.in(frame), launch.in(codes),
              launch.in(triangles), launch.in(joints), launch.in(weights), launch.in(centres), launch.out(),
              x[0], launch.in(joints)[1], launch.in(codes)[1], launch.count_of(x))
        .run(row_items(x), row_group(launch));
  }
  Values gradient(const GradientRequest& request) const override {
    Values in = request.in;
    in.push_back(request.grad());
    Values grads(request.in.size());
    if (request.needed[points]) grads[points] = request.graph.record_one(BonePointsGradient(), in);
    if (request.needed[codes]) grads[codes] = request.graph.record_one(BoneCodesGradient(), in);
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[points].shape[0] * in[joints].shape[1]) * 3 * 24;
  }
};

const RegisterOp register_bone_correction({
    .name = "bone_correction",
    .summary = "small rotations and translations of joints, blended like the skin, as offsets of points",
    .inputs = {{"points", "[N, 3]"},
               {"face", "[N, 1]", DType::i32},
               {"barycentric", "[N, 3]"},
               {"frame", "[N, 1]", DType::i32},
               {"codes", "[frames, J, 6]"},
               {"triangles", "[F, 3]", DType::i32},
               {"joints", "[V, K]", DType::i32},
               {"weights", "[V, K]"},
               {"centres", "[J, 3]"}},
    .outputs = {{"e", "[N, 3]"}},
    .attributes = {},
    .build = [](Graph& graph, const Values& in, const Attributes&) -> Values {
      return {graph.record_one(BoneCorrection(), in)};
    },
});

}  // namespace

Value bone_correction(Value points, Value face, Value barycentric, Value frame, Value codes,
                      const SkinTables& tables) {
  return points.graph->record_one(BoneCorrection(),
                                  {points, face, barycentric, frame, codes, tables.triangles, tables.joints,
                                   tables.weights, tables.centres});
}

}  // namespace vivant
