#include "ops/lanes.hpp"
#include "ops/partials.hpp"
#include "ops/sort.hpp"
#include "vivant/ops/registry.hpp"
#include "vivant/ops/triplane.hpp"

namespace vivant {
namespace {

constexpr std::int64_t points_per_item = 32;  // on CPUs
constexpr std::int64_t row_padding = 48;      // reals between the rows of a private copy
constexpr std::int64_t blocks_across = 16;    // of space, for the order of points

void check_shapes(const Shape& planes, const Shape& points) {
  if (planes.rank() != 4 || planes[0] != 3)
    fail("[triplane_sample] planes must be [3, H, W, C], they are {}", planes.text());
  if (points.rank() != 2 || points[1] != 3)
    fail("[triplane_sample] points must be [N, 3], they are {}", points.text());
}

Lanes lanes_of(const Launch& launch) { return {launch, launch.in(0).channels()}; }

Launch::Call kernel(Launch& launch, const std::string& function, Combine combine) {
  return launch.kernel("triplane_sample.cl", function,
                       lanes_of(launch).defines({{"COMBINE", static_cast<int>(combine)}}));
}

struct PlanesGradient final : Op {
  PlanesGradient(Combine combine, int partitions) : combine(combine), partitions(partitions) {}
  std::string_view name() const override { return "triplane_planes_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {{DType::real, in[0].shape}}; }
  /// What the sort takes, and the partitions' copies (CPU) or the sums of the cells' four texels (GPU).
  TensorTypes workspaces(const TensorTypes& in) const override {
    const Shape& planes = in[0].shape;
    const std::int64_t copy = planes.elements() + 3 * planes[1] * row_padding;
    TensorTypes types = sort_workspaces(3, in[1].shape[0]);
    types.push_back({DType::real, {std::max(partitions * copy, 4 * planes.elements())}});
    return types;
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    launch.gpu() ? add_by_cell(launch) : add_by_partition(launch);
  }

  void add_by_partition(Launch& launch) const {
    const Tensor &planes = launch.in(0), &points = launch.in(1), &copies = launch.workspace(sums_workspace);
    const std::int64_t height = planes[1], width = planes[2];
    const auto all = static_cast<std::size_t>(points.rows());
    scatter_kernel(launch, "triplane_blocks")
        .args(points, launch.workspace(0), points.rows(), launch.count_of(points))
        .run({all, 1, 1}, {64, 1, 1});
    const Sorted sorted = sort(launch, 0, 1, blocks_across * blocks_across * blocks_across);
    scatter_kernel(launch, "triplane_add")
        .args(planes, points, launch.in(2), sorted.places, copies, points.rows(), height, width, partitions,
              launch.count_of(points))
        .run({static_cast<std::size_t>(partitions), 1, 1}, {1, 1, 1});
    scatter_kernel(launch, "triplane_sum")
        .args(copies, launch.out(), 3 * height, width, partitions)
        .run({static_cast<std::size_t>(3 * height), 1, 1}, {1, 1, 1});
  }
  void add_by_cell(Launch& launch) const {
    const Tensor &planes = launch.in(0), &points = launch.in(1), &sums = launch.workspace(sums_workspace);
    const std::int64_t height = planes[1], width = planes[2], cells = height * width;
    const Lanes lanes = lanes_of(launch);
    const auto vectors = static_cast<std::size_t>(lanes.vectors());
    scatter_kernel(launch, "triplane_cells")
        .args(points, launch.workspace(0), points.rows(), height, width, launch.count_of(points))
        .run({static_cast<std::size_t>(points.rows()), 1, 1}, {64, 1, 1});
    const Sorted sorted = sort(launch, 0, 3, cells + 1);
    scatter_kernel(launch, "triplane_cell_sums")
        .args(planes, points, launch.in(2), sorted.keys, sorted.places, sums, points.rows(), height, width)
        .run({vectors, static_cast<std::size_t>(cells), 3}, lanes.group());
    scatter_kernel(launch, "triplane_texels")
        .args(sums, launch.out(), height, width)
        .run({vectors, static_cast<std::size_t>(width), static_cast<std::size_t>(3 * height)}, lanes.group());
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 57.0 *
           static_cast<double>(in[2].shape.elements());  // the samples again, and three times four texels
  }
  Launch::Call scatter_kernel(Launch& launch, const std::string& function) const {
    return launch.kernel("triplane_scatter.cl", function,
                         lanes_of(launch).defines({{"COMBINE", static_cast<int>(combine)},
                                                   {"ROW_PADDING", row_padding},
                                                   {"BLOCKS_ACROSS", blocks_across}}));
  }
  static constexpr int sums_workspace = 5;
  const Combine combine;
  const int partitions;
};

struct PointsGradient final : Op {
  explicit PointsGradient(Combine combine) : combine(combine) {}
  std::string_view name() const override { return "triplane_points_gradient"; }
  TensorTypes infer(const TensorTypes& in) const override { return {in[1]}; }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &planes = launch.in(0), &points = launch.in(1);
    const std::int64_t block = launch.gpu() ? 1 : points_per_item;
    kernel(launch, "triplane_points_gradient", combine)
        .args(planes, points, launch.in(2), launch.out(), points.rows(), planes[1], planes[2], block,
              launch.count_of(points))
        .run({static_cast<std::size_t>((points.rows() + block - 1) / block), 1, 1},
             {launch.gpu() ? std::size_t{64} : 1, 1, 1});
  }
  double flops(const TensorTypes& in, const TensorTypes&) const override {
    return 48.0 * static_cast<double>(in[2].shape.elements());  // the samples again, and their slopes
  }
  const Combine combine;
};

struct TriplaneSample final : Op {
  TriplaneSample(Combine combine, int partitions) : combine(combine), partitions(partitions) {}
  std::string_view name() const override { return "triplane_sample"; }
  TensorTypes infer(const TensorTypes& in) const override {
    check_shapes(in[0].shape, in[1].shape);
    return {{DType::real, in[1].shape.with_channels(in[0].shape.channels()), in[1].count}};
  }
  bool accepts_counts() const override { return true; }
  void launch(Launch& launch) const override {
    const Tensor &planes = launch.in(0), &points = launch.in(1);
    const Lanes lanes = lanes_of(launch);
    const std::int64_t block = launch.gpu() ? 1 : points_per_item;
    kernel(launch, "triplane_sample", combine)
        .args(planes, points, launch.out(), points.rows(), planes[1], planes[2], block,
              launch.count_of(points))
        .run(lanes.items(points.rows(), block), lanes.group());
  }
  Values gradient(const GradientRequest& request) const override {
    const Values in = {request.in[0], request.in[1], request.grad()};
    Values grads(2);
    if (request.needed[0]) grads[0] = request.graph.record_one(PlanesGradient(combine, partitions), in);
    if (request.needed[1]) grads[1] = request.graph.record_one(PointsGradient(combine), in);
    return grads;
  }
  double flops(const TensorTypes&, const TensorTypes& out) const override {
    return 23.0 * static_cast<double>(out[0].shape.elements());  // three bilinear samples and the product
  }
  const Combine combine;
  const int partitions;
};

const RegisterOp register_triplane_sample({
    .name = "triplane_sample",
    .summary = "the product or sum of bilinear samples of three planes at points",
    .inputs = {{"planes", "[3, H, W, C]"}, {"points", "[N, 3]"}},
    .outputs = {{"y", "[N, C]"}},
    .attributes = {{"combine", "product", "product or sum"},
                   {"partitions", 2, "private copies of the planes' gradient"}},
    .build = [](Graph&, const Values& in, const Attributes& a) -> Values {
      return {triplane_sample(in[0], in[1], combine_from(a.text("combine")),
                              static_cast<int>(a.integer("partitions")))};
    },
});

}  // namespace

Combine combine_from(const std::string& name) {
  if (name == "product") return Combine::product;
  if (name == "sum") return Combine::sum;
  throw UsageError(fmt::format("unknown combination '{}': use product or sum", name));
}

Value triplane_sample(Value planes, Value points, Combine combine, int partitions) {
  if (partitions < 1) fail("[triplane_sample] {} partitions: there must be at least one", partitions);
  return planes.graph->record_one(TriplaneSample(combine, partitions), {planes, points});
}

}  // namespace vivant
