// The workloads of radiance fields: a training step of the scene (W1) and a frame of scene and person (W2).
#include "rays.hpp"
#include "vivant/model/composite.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/rays.hpp"
#include "vivant/ops/triplane_encoding.hpp"
#include "workload.hpp"

namespace vivant::bench {
namespace {

constexpr std::uint64_t seed = 1;

/// `encoding`: that of the scene's field; for mlp, `layers` and `width` of the perceptron.
FieldOptions field_options(const Sizes& sizes) {
  FieldOptions options;
  options.plane_size = sizes.at("planes");
  options.encoding = encoding_from(sizes.value("encoding", "full"));
  options.mlp_layers = sizes.value("layers", options.mlp_layers);
  options.mlp_width = sizes.value("width", options.mlp_width);
  return options;
}

/// The box [-1, 1]^3, sampled evenly.
SceneSpace box() {
  SceneSpace space;
  space.near = nearest;
  space.far = farthest;
  space.opaque_last = false;
  return space;
}

/// The field (three U-Nets, or the `encoding` asked for), samples on random rays, densities, colours and
/// rendering; then the loss, backward and Adam, unless `part` is forward.
struct SceneStep final : TrainingWorkload {
  SceneStep(Device& device, const Sizes& sizes)
      : TrainingWorkload(device),
        scene(device, store_, Initializer(seed), field_options(sizes), box(), sizes.at("samples")) {
    const std::int64_t count = sizes.at("rays");
    const FieldOptions& field = scene.field().options();
    store_.allocate(device);
    publish(store_);
    if (field.encoding == Encoding::full) publish_voxels(field.plane_size);
    const HostRays host = random_rays(count);
    const Rays rays = {given("origins", {count, 3}, host.origins),
                       given("directions", {count, 3}, host.directions)};
    const FieldSamples samples = scene.sample(graph_, scene.field().planes(graph_), rays, nullptr);
    const RenderedRays rendered = scene.render(graph_, samples);
    const Value colours = scene.field().colour(graph_, rendered.hidden, rendered.alpha);
    std::map<std::string, Value> outputs = {{"colours", colours}};
    if (sizes.value("part", "training") == "training") {
      outputs["loss"] = l2_loss(colours, input("truth", {count, 3}, {0, 1}));
      train(outputs["loss"], {"scene.unet", "scene.planes", "scene.trunk", "scene.density", "scene.hidden",
                              "scene.direction", "scene.colour"});
    }
    prepare(outputs);
  }

  /// What the U-Nets read, computed by the field itself as well.
  void publish_voxels(std::int64_t size) {
    Graph once;
    const Value voxels = triplane_encoding(once, size, scene.field().options().position_frequencies);
    Executor encoder(device_, once, {voxels});
    encoder.run();
    publish("voxels", voxels.shape(), encoder.read(voxels));
  }

  SceneModel scene;
};

/// Random numbers on a coarse grid, between them smooth: [3, size, size, channels].
std::vector<float> smooth_planes(const std::string& name, std::int64_t size, std::int64_t channels) {
  constexpr std::int64_t coarse = 8;
  const std::vector<float> grid = numbers(name, 3 * coarse * coarse * channels, {0.2, 1.8});
  std::vector<float> planes(3 * size * size * channels);
  const auto place = [&](std::int64_t i) {
    return static_cast<double>(i) / static_cast<double>(size - 1) * (coarse - 1.001);
  };
  std::size_t next = 0;
  for (std::int64_t plane = 0; plane < 3; ++plane)
    for (std::int64_t row = 0; row < size; ++row)
      for (std::int64_t column = 0; column < size; ++column) {
        const double y = place(row), x = place(column);
        const auto top = static_cast<std::int64_t>(y), left = static_cast<std::int64_t>(x);
        const double v = y - static_cast<double>(top), u = x - static_cast<double>(left);
        const float* corner = &grid[((plane * coarse + top) * coarse + left) * channels];
        for (std::int64_t c = 0; c < channels; ++c) {
          const double above = corner[c] * (1 - u) + corner[channels + c] * u,
                       below =
                           corner[coarse * channels + c] * (1 - u) + corner[(coarse + 1) * channels + c] * u;
          planes[next++] = static_cast<float>(above * (1 - v) + below * v);
        }
      }
  return planes;
}

/// A frame in tiles from planes that are given. Densities rise steeply where the first feature exceeds 1.5,
/// so that there are surfaces. Samples that weigh less than `threshold` have no hidden units; with 0 all
/// have.
struct Frame final : Workload {
  Frame(Device& device, const Sizes& sizes)
      : Workload(device),
        scene(device, store_, Initializer(seed), field_options(sizes), box(), sizes.at("samples")),
        person(device, store_, Initializer(seed), "human", field_options(sizes)),
        pixels(sizes.at("height").get<std::int64_t>() * sizes.at("width").get<std::int64_t>()),
        tile(std::min<std::int64_t>(4096, pixels)),
        host(frame_rays(sizes.at("height"), sizes.at("width"))),
        near(numbers("near", pixels, {1.4, 1.6})),
        far(numbers("far", pixels, {2.6, 2.8})) {
    store_.allocate(device);
    for (const std::string field : {"scene", "human"}) {
      std::vector<float> weight(32, 0.0f);
      weight[0] = 8;
      store_.write(field + ".density.weight", weight);
      store_.write(field + ".density.bias", std::vector<float>{-12});
    }
    publish(store_);
    publish("origins", {pixels, 3}, host.origins);
    publish("directions", {pixels, 3}, host.directions);
    publish("near", {pixels, 1}, near);
    publish("far", {pixels, 1}, far);
    const std::int64_t size = sizes.at("planes"), samples = sizes.at("samples");
    const auto planes = [&](const std::string& name) {
      return given(name, {3, size, size, 32}, smooth_planes(name, size, 32));
    };
    origins = graph_.input("tile origins", {tile, 3});
    directions = graph_.input("tile directions", {tile, 3});
    tile_near = graph_.input("tile near", {tile, 1});
    tile_far = graph_.input("tile far", {tile, 1});
    const FieldSamples scene_samples =
        scene.sample(graph_, planes("scene planes"), {origins, directions}, nullptr);
    const CompositeRays rays =
        composite(graph_, scene_samples, person_samples(planes("human planes"), samples), Intervals::own,
                  sizes.at("threshold"));
    colours = add(scene.field().colour(graph_, rays.scene_hidden, rays.scene_alpha),
                  person.colour(graph_, rays.human_hidden, rays.human_alpha));
    prepare({{"colours", colours}});
    image.resize(pixels * 3);
  }

  HumanFieldSamples person_samples(Value planes, std::int64_t samples) {
    const std::vector<std::int32_t> zero(1, 0);
    const Value none = graph_.constant({1}, std::span<const std::int32_t>(zero));
    const Samples drawn = stratified_samples(tile_near, tile_far, static_cast<int>(samples), Spacing::linear,
                                             {none, none, 0}, false);
    const Value features = person.features(graph_, planes, points_on_rays(origins, directions, drawn.depths));
    const Value density = person.density(graph_, features);
    return {.depths = drawn.depths,
            .deltas = drawn.deltas,
            .density = graph_.reshape(density, drawn.depths.shape()),
            .row_density = density,
            .units = person.units_of_rays(graph_, features, {directions})};
  }

  void run() override {
    for (std::int64_t first = 0; first < pixels; first += tile) {
      const std::int64_t start = std::min(first, pixels - tile);  // the last tile overlaps the one before
      const auto rows = [&](const std::vector<float>& all, std::int64_t columns) {
        return std::span<const float>(all).subspan(start * columns, tile * columns);
      };
      executor_->write(origins, rows(host.origins, 3));
      executor_->write(directions, rows(host.directions, 3));
      executor_->write(tile_near, rows(near, 1));
      executor_->write(tile_far, rows(far, 1));
      executor_->run();
      const std::vector<float> part = executor_->read(colours);
      std::copy(part.begin(), part.end(), image.begin() + start * 3);
    }
  }

  TensorFile results() override {
    TensorFile file;
    file.tensors["colours"] = HostTensor({pixels, 3}, std::span<const float>(image));
    return file;
  }

  SceneModel scene;
  Field person;
  const std::int64_t pixels, tile;
  const HostRays host;
  const std::vector<float> near, far;
  Value origins, directions, tile_near, tile_far, colours;
  std::vector<float> image;
};

}  // namespace

WorkloadTable field_workloads() { return {{"scene step", make<SceneStep>}, {"frame", make<Frame>}}; }

}  // namespace vivant::bench
