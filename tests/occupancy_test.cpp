// Rendering that looks only at samples in occupied space, in front of surfaces, against rendering all of
// them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "graph_helpers.hpp"
#include "vivant/model/baked_scene.hpp"

using namespace vivant;

namespace {

constexpr std::int64_t plane_size = 64, channels = 16, side = 24;
constexpr int samples_per_ray = 64;
constexpr double threshold = 1e-4;

/// Nothing but a solid cube, |x|, |y|, |z| < 0.4, with a pattern on it.
struct CubeScene {
  ParameterStore store;
  SceneModel model;
  CubeScene()
      : model(test_device(), store, Initializer(3),
              {.encoding = Encoding::vanilla, .plane_size = plane_size, .channels = channels},
              {.radius = Eigen::Vector3d(1, 1, 1), .near = 0.5, .far = 4.5, .opaque_last = false},
              samples_per_ray) {
    store.allocate(test_device());
    std::vector<float> planes = store.read("scene.planes");
    for (std::int64_t i = 0; i < 3 * plane_size * plane_size; ++i) {
      const auto inside = [](std::int64_t place) {
        return std::abs((static_cast<double>(place) + 0.5) / plane_size * 2 - 1) < 0.4;
      };
      planes[i * channels] = inside(i % plane_size) && inside(i / plane_size % plane_size) ? 1.0f : 0.0f;
    }
    store.write("scene.planes", planes);
    std::vector<float> density(channels, 0.0f);
    density[0] = 16;
    store.write("scene.density.weight", density);
    store.write("scene.density.bias", std::vector<float>{-12});
  }
};

/// Rays from (0, 0, -2.5) through a window of the plane z = 0; some see nothing.
Rays rays_to_cube(Graph& graph) {
  std::vector<double> origins, directions;
  for (std::int64_t i = 0; i < side * side; ++i) {
    const auto across = [](std::int64_t place) {
      return (static_cast<double>(place) + 0.5) / side * 1.8 - 0.9;
    };
    const Eigen::Vector3d direction = Eigen::Vector3d(across(i % side), across(i / side), 2.5).normalized();
    for (const double x : {0.0, 0.0, -2.5}) origins.push_back(x);
    directions.insert(directions.end(), direction.begin(), direction.end());
  }
  return {graph.constant({side * side, 3}, origins), graph.constant({side * side, 3}, directions)};
}

}  // namespace

TEST_CASE("occupancy: empty space and what lies behind surfaces is not looked at, and the picture stays") {
  const CubeScene scene;
  const Field& field = scene.model.field();
  Graph graph;
  const Rays rays = rays_to_cube(graph);
  const FieldSamples all = BakedScene(test_device(), scene.model, 0).sample(graph, rays, Output::colour);
  const FieldSamples some =
      BakedScene(test_device(), scene.model, threshold).sample(graph, rays, Output::colour);
  REQUIRE(some.units.rows);
  CHECK(!all.units.rows);
  CHECK_THROWS_WITH(hidden_units(some.units), doctest::Contains("left out"));
  const RenderedRays plain = scene.model.render(graph, all, threshold),
                     quick = scene.model.render(graph, some, threshold);
  const Value plain_colour = field.colour(graph, plain.hidden, plain.alpha),
              quick_colour = field.colour(graph, quick.hidden, quick.alpha);
  Executor executor(test_device(), graph,
                    {plain_colour, quick_colour, plain.alpha, quick.alpha, some.units.rows});
  executor.run();
  const auto largest_difference = [&](Value a, Value b) {
    const std::vector<float> x = executor.read(a), y = executor.read(b);
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      largest = std::max(largest, std::abs(static_cast<double>(x[i]) - y[i]));
    return largest;
  };
  constexpr double bound = (samples_per_ray + 1) * threshold;
  CHECK(largest_difference(plain.alpha, quick.alpha) < bound);
  CHECK(largest_difference(plain_colour, quick_colour) <
        2 * bound);  // hidden units of a new field are below 1
  const std::vector<float> alpha = executor.read(plain.alpha);
  CHECK(*std::min_element(alpha.begin(), alpha.end()) < 0.01);
  CHECK(*std::max_element(alpha.begin(), alpha.end()) > 0.99);
  const std::vector<std::int32_t> rows = executor.read_ints(some.units.rows);
  const auto looked_at = std::count_if(rows.begin(), rows.end(), [](std::int32_t row) { return row >= 0; });
  // The cube and the cells around it hold 8 % of the samples, of which a fifth lies behind its front.
  CHECK(looked_at > 0);
  CHECK(looked_at < static_cast<std::ptrdiff_t>(rows.size() / 14));
}
