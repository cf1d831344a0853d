#include "ops/lanes.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {
namespace {

constexpr std::int64_t rows_per_item = 64;  // on CPUs

Launch::Call kernel(Launch& launch, const std::string& function, const Lanes& lanes, const Tensor& ids,
                    bool past_caches = false) {
  return launch.kernel("weighted_sum.cl", function,
                       lanes.defines({{"HAS_IDS", ids ? 1 : 0}, {"PAST_CACHES", past_caches ? 1 : 0}}));
}

/// Inputs: weight (for its shape), feature, ids or absent, gradient of the sum.
struct WeightGradient final : Op {
  std::string_view name() const override { return "weighted_sum_weight_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, in[0].shape}}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &feature = launch.in(1), &ids = launch.in(2);
    const std::int64_t block = launch.gpu() ? 1 : rows_per_item;
    if (ids) launch.zero(launch.out());
    kernel(launch, "weighted_sum_weight_gradient", {launch, feature.channels()}, ids)
        .args(feature, ids, launch.in(3), launch.out(), weight[1], feature.rows(), block,
              launch.count_of(feature))
        .run({static_cast<std::size_t>((feature.rows() + block - 1) / block), 1, 1},
             {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 2.0 * static_cast<double>(in[1].shape.elements());
  }
};

/// Inputs: weight, feature (for its shape and count), ids or absent, gradient of the sum.
struct FeatureGradient final : Op {
  std::string_view name() const override { return "weighted_sum_feature_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[1]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &feature = launch.in(1), &ids = launch.in(2);
    const Lanes lanes(launch, feature.channels());
    const std::int64_t block = launch.gpu() ? 1 : rows_per_item;
    constexpr std::int64_t in_caches = 1 << 24;  // numbers: 64 MiB in fp32
    kernel(launch, "weighted_sum_feature_gradient", lanes, ids,
           !launch.gpu() && feature.elements() > in_caches)
        .args(weight, ids, launch.in(3), launch.out(), weight[1], feature.rows(), block,
              launch.count_of(feature))
        .run(lanes.items(feature.rows(), block), lanes.group());
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return static_cast<double>(in[1].shape.elements());
  }
};

struct WeightedSum final : Op {
  std::string_view name() const override { return "weighted_sum"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &weight = in[0].shape, &feature = in[1].shape, &ids = in[2].shape;
    if (weight.rank() != 2) fail("[weighted_sum] weight must be [rays, samples], it is {}", weight.text());
    if (ids.rank() == 0) {
      if (feature.rows() != weight.elements())
        fail("[weighted_sum] feature {} has {} rows, weight {} has {} samples", feature.text(),
             feature.rows(), weight.text(), weight.elements());
      if (in[1].count >= 0) fail("[weighted_sum] feature has a device-side count of rows, but no ids");
    } else if (in[2].dtype != DType::i32 || ids.elements() != feature.rows()) {
      fail("[weighted_sum] ids must be i32, one for each of the {} rows of feature, they are {} {}",
           feature.rows(), name_of(in[2].dtype), ids.text());
    }
    return {{DType::real, {weight[0], feature.channels()}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &feature = launch.in(1), &ids = launch.in(2);
    const Lanes lanes(launch, feature.channels());
    kernel(launch, "weighted_sum", lanes, ids)
        .args(weight, feature, ids, launch.out(), weight[0], weight[1], feature.rows(),
              launch.count_of(feature))
        .run(lanes.items(weight[0]), lanes.group());
  }
  Values gradient(const GradientRequest& request) const override {
    const Values in = {request.in[0], request.in[1], request.in[2], request.grad()};
    Values grads(3);
    if (request.needed[0]) grads[0] = request.graph.record_one(WeightGradient(), in);
    if (request.needed[1]) grads[1] = request.graph.record_one(FeatureGradient(), in);
    return grads;
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 2.0 * static_cast<double>(in[1].shape.elements());
  }
};

const RegisterOp register_weighted_sum({
    .name = "weighted_sum",
    .summary = "the sum over each ray's samples of weight times feature",
    .inputs = {{"weight", "[R, S]"},
               {"feature", "[R * S, C], [R, S, C] or, with ids, [N, C]"},
               {.name = "ids", .shape = "[N]", .dtype = DType::i32, .optional = true}},
    .outputs = {{"y", "[R, C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {weighted_sum(in[0], in[1], in[2])};
    },
});

}  // namespace

Value weighted_sum(Value weight, Value feature, Value ids) {
  return weight.graph->record_one(WeightedSum(), {weight, feature, ids});
}

}  // namespace vivant
