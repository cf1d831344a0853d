#include "vivant/ops/mean_variance_norm.hpp"

#include "ops/partials.hpp"
#include "ops/rows.hpp"
#include "vivant/ops/registry.hpp"

namespace vivant {
namespace {

constexpr double epsilon = 1e-5;
constexpr const char* file = "mean_variance_norm.cl";

/// Runs over (chunks of rows, vectors of channels).
void run_over_chunks(Launch::Call& call, const Launch& launch, const Tensor& x) {
  call.run({static_cast<std::size_t>(chunks_of(x.rows())), vectors(launch, x.channels())[0], 1}, {1, 1, 1});
}

TensorTypes two_partial_sums(const Shape& x) {
  return {{DType::real, {chunks_of(x.rows()), 2, x.channels()}}, {DType::real, {2, x.channels()}}};
}

/// Inputs: x, mean, deviation, gradients of mean and deviation.
struct StatisticsGradient final : Op {
  std::string_view name() const override { return "channel_statistics_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    auto call = launch.kernel(file, "statistics_gradient");
    call.args(x, launch.in(1), launch.in(2), launch.in(3), launch.in(4), launch.out(), x.rows(), x.channels(),
              launch.count_of(x));
    run_over_rows(call, launch, x.rows(), x.channels());
  }
};

struct Statistics final : Op {
  std::string_view name() const override { return "channel_statistics"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.rows() < 2)
      fail("[channel_statistics] {} has no two rows to take a variance of", in[0].shape.text());
    const TensorType row{DType::real, {in[0].shape.channels()}};
    return {row, row};
  }
  bool accepts_counts() const override { return true; }
  TensorTypes workspaces(const TensorTypes& in) const override { return two_partial_sums(in[0].shape); }
  void launch(Launch& launch) const override {
    const Tensor &x = launch.in(0), &partial = launch.workspace();
    auto call = launch.kernel(file, "statistics_partial");
    call.args(x, partial, x.rows(), x.channels(), chunk_length(x.rows()), launch.count_of(x));
    run_over_chunks(call, launch, x);
    launch.kernel(file, "statistics_combine")
        .args(partial, launch.out(0), launch.out(1), partial[0], x.rows(), x.channels(),
              chunk_length(x.rows()), epsilon, launch.count_of(x))
        .run(vectors(launch, x.channels()), {1, 1, 1});
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(StatisticsGradient(), {request.in[0], request.out[0], request.out[1],
                                                            request.grad(0), request.grad(1)})};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 4.0 * static_cast<double>(in[0].shape.elements());
  }
};

/// Inputs: y, deviation, gradient of y.
struct StandardiseGradient final : Op {
  explicit StandardiseGradient(bool own_statistics) : own_statistics(own_statistics) {}
  std::string_view name() const override { return "mean_variance_norm_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[0]}; }
  bool accepts_counts() const override { return true; }
  TensorTypes workspaces(const TensorTypes& in) const override {
    return own_statistics ? two_partial_sums(in[0].shape) : TensorTypes{};
  }
  void launch(Launch& launch) const override {
    const Tensor &y = launch.in(0), &grad = launch.in(2);
    Tensor sums;
    if (own_statistics) {
      sums = launch.workspace(1);
      auto call = launch.kernel(file, "standardise_partial");
      call.args(y, grad, launch.workspace(0), y.rows(), y.channels(), chunk_length(y.rows()),
                launch.count_of(y));
      run_over_chunks(call, launch, y);
      reduce_partials(launch, launch.workspace(0), sums, chunks_of(y.rows()), 2 * y.channels());
    }
    auto call = launch.kernel(file, "standardise_gradient");
    call.args(y, launch.in(1), grad, sums, launch.out(), y.rows(), y.channels(), launch.count_of(y));
    run_over_rows(call, launch, y.rows(), y.channels());
  }
  const bool own_statistics;
};

/// Inputs: x, mean, deviation. With `own_statistics`, those two come from x and the gradient of x covers
/// them.
struct Standardise final : Op {
  explicit Standardise(bool own_statistics) : own_statistics(own_statistics) {}
  std::string_view name() const override { return "mean_variance_norm"; }
  TensorTypes infer(const TensorTypes& in) const override {
    for (int i : {1, 2})
      if (in[i].shape.elements() != in[0].shape.channels())
        fail("[mean_variance_norm] statistics {} do not fit x {}", in[i].shape.text(), in[0].shape.text());
    return {in[0]};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor& x = launch.in(0);
    auto call = launch.kernel(file, "standardise");
    call.args(x, launch.in(1), launch.in(2), launch.out(), x.rows(), x.channels(), launch.count_of(x));
    run_over_rows(call, launch, x.rows(), x.channels());
  }
  Values gradient(const GradientRequest& request) const override {
    return {request.graph.record_one(StandardiseGradient(own_statistics),
                                     {request.out[0], request.in[2], request.grad()}),
            Value{}, Value{}};
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 2.0 * static_cast<double>(in[0].shape.elements());
  }
  const bool own_statistics;
};

/// Inputs: running, batch, stop or absent.
struct UpdateRunning final : Op {
  explicit UpdateRunning(double momentum) : momentum(momentum) {}
  std::string_view name() const override { return "update_running_statistics"; }
  TensorTypes infer(const TensorTypes& in) const override {
    if (in[0].shape.elements() != in[1].shape.elements())
      fail("[update_running_statistics] statistics {} do not fit running ones {}", in[1].shape.text(),
           in[0].shape.text());
    if (in[2].shape.rank() > 0 && in[2].dtype != DType::i32)
      fail("[update_running_statistics] stop must be i32, it is {}", name_of(in[2].dtype));
    return {};
  }
  void launch(Launch& launch) const override {
    const std::int64_t channels = launch.in(0).elements();
    launch.kernel(file, "update_running")
        .args(launch.in(0), launch.in(1), launch.in(2), channels, momentum)
        .run({static_cast<std::size_t>(channels), 1, 1}, {64, 1, 1});
  }
  const double momentum;
};

const RegisterOp register_statistics({
    .name = "channel_statistics",
    .summary = "mean and standard deviation of every channel over all rows",
    .inputs = {{"x", "[..., C]"}},
    .outputs = {{"mean", "[C]"}, {"deviation", "[C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      const ChannelStatistics statistics = channel_statistics(in[0]);
      return {statistics.mean, statistics.deviation};
    },
});
const RegisterOp register_norm({
    .name = "mean_variance_norm",
    .summary = "(x - mean) / deviation by channel, with given statistics or those of x",
    .inputs = {{"x", "[..., C]"},
               {.name = "mean", .shape = "[C]", .optional = true},
               {.name = "deviation", .shape = "[C]", .optional = true}},
    .outputs = {{"y", "[..., C]"}},
    .attributes = {},
    .build = [](Graph&, const Values& in, const Attributes&) -> Values {
      return {in[1] ? mean_variance_norm(in[0], {in[1], in[2]}) : mean_variance_norm(in[0])};
    },
});

}  // namespace

ChannelStatistics channel_statistics(Value x) {
  const Values out = x.graph->record(std::make_shared<Statistics>(), {x});
  return {out[0], out[1]};
}

Value mean_variance_norm(Value x) {
  const ChannelStatistics own = channel_statistics(x);
  return x.graph->record_one(Standardise(true), {x, own.mean, own.deviation});
}

Value mean_variance_norm(Value x, const ChannelStatistics& given) {
  return x.graph->record_one(Standardise(false), {x, given.mean, given.deviation});
}

void update_running_statistics(const ChannelStatistics& running, const ChannelStatistics& batch,
                               double momentum, Value stop) {
  const auto update = std::make_shared<UpdateRunning>(momentum);
  running.mean.graph->record(update, {running.mean, batch.mean, stop}, true);
  running.mean.graph->record(update, {running.deviation, batch.deviation, stop}, true);
}

}  // namespace vivant
