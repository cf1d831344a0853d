#include "vivant/ops/weighted_units.hpp"

#include "ops/lanes.hpp"
#include "ops/partials.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

/// The least weight that counts; without a threshold every weight does.
double least_weight(double threshold) { return threshold > 0 ? threshold : -1e30; }

constexpr std::int64_t shortest_chunk = 8, most_chunks = 256;  // rays of one work-item of the gradient

std::int64_t largest_divisor(std::int64_t n, std::int64_t most) {
  while (n % most != 0) --most;
  return most;
}

/// A kernel for x [R S, C] and units [R, N].
Launch::Call kernel(Launch& launch, const char* function, const Lanes& lanes, std::int64_t inner,
                    bool of_samples = true, bool has_rows = false) {
  constexpr std::int64_t accumulators = 24;  // of the 32 vector registers
  return launch.kernel("weighted_units.cl", function,
                       {{"CHANNELS", lanes.channels},
                        {"LANES", lanes.lanes},
                        {"INNER", inner},
                        {"SAMPLE_GRADIENT", of_samples ? 1 : 0},
                        {"HAS_ROWS", has_rows ? 1 : 0},
                        {"INNER_LANES", std::min<std::int64_t>(16, inner & -inner)},
                        {"GROUP", std::clamp<std::int64_t>(accumulators / lanes.vectors(), 1, 12)},
                        {"LAYER_ROWS", largest_divisor(inner, 4)},
                        {"LAYER_VECTORS", largest_divisor(lanes.vectors(), 4)}});
}

/// Inputs: weight, x, w, term, rows or absent, gradient of y. Outputs: the gradients of the first four, or of
/// w and term alone (`of_samples` false).
struct Gradient final : Op {
  Gradient(double threshold, bool of_samples) : threshold(threshold), of_samples(of_samples) {}
  std::string_view name() const override { return "weighted_units_gradient"; }
  bool accepts_counts() const override { return true; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (!of_samples) return {in[2], in[3]};
    return {in[0], in[1], in[2], in[3]};
  }
  TensorTypes workspaces(const TensorTypes& in) const override {
    const std::int64_t chunks = chunks_of(in[0].shape[0], shortest_chunk, most_chunks);
    return {{DType::real, {chunks, in[2].shape[0], in[2].shape[1]}}, {DType::real, {chunks, in[2].shape[1]}}};
  }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &x = launch.in(1), &w = launch.in(2), &term = launch.in(3);
    const Tensor &rows = launch.in(4), &grad_y = launch.in(5);
    const Tensor &partial = launch.workspace(0), &partial_term = launch.workspace(1);
    const Lanes lanes(launch, w[1]);
    const bool has_rows = static_cast<bool>(rows);
    const bool per_ray = term.shape().rank() == 2;
    const Tensor none, &grad_weight = of_samples ? launch.out(0) : none,
                       &grad_x = of_samples ? launch.out(1) : none;
    const int layer = of_samples ? 2 : 0;
    const Tensor& grad_term = per_ray ? launch.out(layer + 1) : partial_term;
    const std::int64_t rays = weight[0], samples = weight[1], stride = per_ray ? w[1] : 0;
    const std::int64_t chunk = chunk_length(rays, shortest_chunk, most_chunks);
    if (launch.gpu()) {
      if (of_samples)
        kernel(launch, "weighted_units_sample_gradient", lanes, w[0])
            .args(weight, x, w, term, grad_y, grad_weight, grad_x, rays, samples, stride,
                  least_weight(threshold))
            .run({static_cast<std::size_t>(rays * samples), 1, 1}, {64, 1, 1});
      kernel(launch, "weighted_units_layer_gradient", lanes, w[0], of_samples, has_rows)
          .args(weight, x, w, term, rows, grad_y, grad_term, partial, rays, samples, stride,
                least_weight(threshold), chunk)
          .run(lanes.items(partial[0]), lanes.group());
    } else {
      kernel(launch, "weighted_units_gradient", lanes, w[0], of_samples, has_rows)
          .args(weight, x, w, term, rows, grad_y, grad_weight, grad_x, grad_term, partial, rays, samples,
                stride, least_weight(threshold), chunk)
          .run({static_cast<std::size_t>(partial[0]), 1, 1}, {1, 1, 1});
    }
    reduce_partials(launch, partial, launch.out(layer), partial[0], w.elements());
    if (!per_ray) reduce_partials(launch, partial_term, launch.out(layer + 1), partial[0], w[1]);
  }
  /// As if no sample were left out: the host does not know how many are.
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return (of_samples ? 6.0 : 4.0) * static_cast<double>(in[1].shape.elements()) *
           static_cast<double>(in[2].shape[1]);
  }
  const double threshold;
  const bool of_samples;
};

struct WeightedUnits final : Op {
  explicit WeightedUnits(double threshold) : threshold(threshold) {}
  std::string_view name() const override { return "weighted_units"; }
  TensorTypes infer(const TensorTypes& in) const override {
    const Shape &weight = in[0].shape, &x = in[1].shape, &w = in[2].shape, &term = in[3].shape;
    if (weight.rank() != 2) fail("[weighted_units] weight must be [rays, samples], it is {}", weight.text());
    const bool has_rows = in.size() > 4 && in[4].shape.rank() > 0;
    if (has_rows && (in[4].dtype != DType::i32 || in[4].shape != weight || !(threshold > 0)))
      fail("[weighted_units] rows must be i32 {}, with a threshold above 0", weight.text());
    for (std::size_t i = 0; i < in.size(); ++i)
      if (i != 1 && in[i].count >= 0) fail("[weighted_units] only x may have a device-side count of rows");
    if (!has_rows && in[1].count >= 0)
      fail("[weighted_units] x has a device-side count of rows, but no rows say which samples they are");
    if (!has_rows && x.rows() != weight.elements())
      fail("[weighted_units] x {} has {} rows, weight {} has {} samples", x.text(), x.rows(), weight.text(),
           weight.elements());
    if (w.rank() != 2 || w[0] != x.channels())
      fail("[weighted_units] w must be [{}, units], it is {}", x.channels(), w.text());
    if (term.channels() != w[1] || (term.rank() != 1 && (term.rank() != 2 || term[0] != weight[0])))
      fail("[weighted_units] term must be [{}] or [{}, {}], it is {}", w[1], weight[0], w[1], term.text());
    return {{DType::real, {weight[0], w[1]}}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &weight = launch.in(0), &x = launch.in(1), &w = launch.in(2), &term = launch.in(3),
                 &rows = launch.in(4);
    const Lanes lanes(launch, w[1]);
    const std::int64_t rays = weight[0];
    kernel(launch, "weighted_units", lanes, w[0], true, static_cast<bool>(rows))
        .args(weight, x, w, term, rows, launch.out(), rays, weight[1], term.shape().rank() == 2 ? w[1] : 0,
              least_weight(threshold))
        .run(launch.gpu() ? lanes.items(rays)
                          : std::array<std::size_t, 3>{static_cast<std::size_t>(rays), 1, 1},
             launch.gpu() ? lanes.group() : std::array<std::size_t, 3>{1, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    const Values& in = request.in;
    const bool of_samples = request.needed[0] || request.needed[1];
    if (in[4] && of_samples)
      fail("[weighted_units] where x holds only some of the samples, these have no gradient");
    const Values grads = request.graph.record(std::make_shared<Gradient>(threshold, of_samples),
                                              {in[0], in[1], in[2], in[3], in[4], request.grad()});
    return of_samples ? Values{grads[0], grads[1], grads[2], grads[3], Value{}}
                      : Values{Value{}, Value{}, grads[0], grads[1], Value{}};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 2.0 * static_cast<double>(in[1].shape.elements()) * static_cast<double>(in[2].shape[1]);
  }
  const double threshold;
};

const RegisterOp register_weighted_units({
    .name = "weighted_units",
    .summary = "the sum over each ray's samples of weight times relu(x . w + term)",
    .inputs = {{"weight", "[R, S]"},
               {"x", "[R * S, C] or, with rows, [K, C]"},
               {"w", "[C, N]"},
               {"term", "[N] or [R, N]"},
               {.name = "rows", .shape = "[R, S]", .dtype = DType::i32, .optional = true}},
    .outputs = {{"y", "[R, N]"}},
    .attributes = {{"threshold", 0.0, "samples that weigh less are left out"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {weighted_units(in[0], in[1], in[2], in[3], a.number("threshold"), in[4])};
    },
});

}  // namespace

Value weighted_units(Value weight, Value x, Value w, Value term, double threshold, Value rows) {
  return weight.graph->record_one(WeightedUnits(threshold), {weight, x, w, term, rows});
}

}  // namespace vivant
