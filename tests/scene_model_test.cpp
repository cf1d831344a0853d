// The scene's samples: where on a ray they are.
#include "vivant/model/scene_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "graph_helpers.hpp"

using namespace vivant;

TEST_CASE("scene model: samples of a bounded space end at its box, those of rays that miss it at far") {
  constexpr int sample_count = 16;
  Device& device = test_device();
  const auto depths = [&](bool bounded) {
    ParameterStore store;
    const SceneModel scene(device, store, Initializer(3),
                           {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16},
                           {.centre = Eigen::Vector3d(1, 0, 0),
                            .radius = Eigen::Vector3d(2, 1, 4),
                            .bounded = bounded,
                            .near = 0.5,
                            .far = 20,
                            .opaque_last = false},
                           sample_count);
    store.allocate(device);
    Graph graph;
    // From the centre along z (4 to the wall); from above into the box (1 to 3); away from it; past `far`.
    const Rays rays{graph.constant({4, 3}, std::vector<double>{1, 0, 0, 1, 2, 0, 10, 0, 0, 1, 0, -30}),
                    graph.constant({4, 3}, std::vector<double>{0, 0, 1, 0, -1, 0, 1, 0, 0, 0, 0, 1})};
    const Value drawn = scene.sample(graph, scene.field().planes(graph), rays, nullptr).depths;
    Run run(graph, {drawn});
    return run.read(drawn);
  };
  const auto range = [&](const std::vector<float>& all, int ray) {
    const auto first = all.begin() + ray * sample_count;
    // In the middle of the first and the last of the strata.
    const double low = *first, high = *(first + sample_count - 1);
    CHECK(std::is_sorted(first, first + sample_count));
    const double half = 0.5 * (high - low) / (sample_count - 1);
    return std::pair(low - half, high + half);
  };
  const auto near = [](double a) { return doctest::Approx(a).epsilon(1e-4); };
  const std::vector<float> inside = depths(true), all = depths(false);
  for (int ray = 0; ray < 4; ++ray) {
    CHECK(range(all, ray).first == near(0.5));
    CHECK(range(all, ray).second == near(20));
  }
  CHECK(range(inside, 0).first == near(0.5));
  CHECK(range(inside, 0).second == near(4 * 1.01));
  CHECK(range(inside, 1).first == near(1));
  CHECK(range(inside, 1).second == near(3 * 1.01));
  CHECK(range(inside, 2).first == near(0.5));
  CHECK(range(inside, 2).second == near(20));
  CHECK(range(inside, 3).first == near(0.99 * 20));
  CHECK(range(inside, 3).second == near(20));
}

TEST_CASE("scene model: samples are drawn where the weight of coarse ones is") {
  constexpr int coarse_count = 8, sample_count = 32;
  Device& device = test_device();
  // The depths of a ray through a field of about this density everywhere.
  const auto depths = [&](double density) {
    ParameterStore store;
    const SceneModel scene(
        device, store, Initializer(3),
        {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16, .density_bias = std::log(density)},
        {.bounded = false, .near = 1, .far = 9, .opaque_last = false}, sample_count, {}, coarse_count);
    store.allocate(device);
    store.write("scene.density.weight", std::vector<float>(16, 0.0f));
    Graph graph;
    const Rays rays{graph.constant({1, 3}, std::vector<double>{0, 0, -5}),
                    graph.constant({1, 3}, std::vector<double>{0, 0, 1})};
    const Value drawn = scene.sample(graph, scene.field().planes(graph), rays, nullptr).depths;
    Run run(graph, {drawn});
    const std::vector<float> found = run.read(drawn);
    CHECK(std::is_sorted(found.begin(), found.end()));
    CHECK(found.front() >= 1);
    CHECK(found.back() <= 9);
    return found;
  };
  const auto nearer_than = [](const std::vector<float>& all, double depth) {
    return std::count_if(all.begin(), all.end(), [&](float d) { return d < depth; });
  };
  const std::vector<float> empty = depths(1e-6), solid = depths(20);
  CHECK(std::abs(nearer_than(empty, 5) - sample_count / 2) <= 3);  // evenly over the bins
  CHECK(nearer_than(solid, 4) > 0.8 * sample_count);               // the ray ends in the first interval
  CHECK(nearer_than(solid, 9) == sample_count);
}
