// The scene's samples: where on a ray they are.
#include "vivant/model/scene_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "body_helpers.hpp"
#include "graph_helpers.hpp"
#include "vivant/model/scene_space.hpp"

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

TEST_CASE("scene space: a camera that only rotates has a far shell and the floor under the person's feet") {
  Capture capture;
  capture.human.emplace();
  capture.human->body = chain_body();  // 3 m tall; its feet are at the translation
  for (int i = 0; i < 20; ++i) {
    capture.human->poses.pose.push_back(Pose(3, Eigen::Vector3d::Zero()));
    capture.human->poses.translation.emplace_back(0.3 * i - 3, -1.5, -6);
    Camera& camera = capture.frames.emplace_back().camera;
    camera = {.width = 64, .height = 48, .fx = 40, .fy = 40, .cx = 32, .cy = 24};
    camera.world_to_camera.row(1) *= -1;  // y up, looking along -z
    camera.world_to_camera.row(2) *= -1;
    capture.frames.back().body_frame = i;
  }
  const SceneSpace space = scene_space(capture, {});
  REQUIRE(space.shell);
  CHECK(space.shell->has_floor());
  CHECK(space.shell->inner_floor == doctest::Approx(1.5));
  CHECK(space.shell->outer_floor == doctest::Approx(1.5 * 1.05));
  CHECK(space.shell->inner_radius > 8);
  // All that the camera sees lies in the box: the floor below, the shell in front.
  CHECK(space.centre.y() - space.radius.y() < -1.5 * 1.05);
  CHECK(space.centre.y() - space.radius.y() > -2);
  CHECK(space.centre.z() - space.radius.z() < -space.far);
  const SceneSpace without = scene_space(capture, {.ground = false});
  CHECK(!without.shell->has_floor());
  // A floor that falls to one side reaches lowest between the corners: no sample lies beyond the box.
  Capture tilted = capture;
  for (int i = 0; i < 20; ++i) tilted.human->poses.translation[i].y() += 0.03 * i - 0.3;
  const SceneSpace falling = scene_space(tilted, {});
  CHECK(falling.shell->up[0] < -0.05);
  double lowest = 0;
  for (double x = 0; x <= 64; x += 0.5)
    for (double y = 0; y <= 48; y += 0.5) {
      const Eigen::Vector3d d = capture.frames[0].camera.ray({x, y}).direction;
      const double down =
          -(falling.shell->up[0] * d.x() + falling.shell->up[1] * d.y() + falling.shell->up[2] * d.z());
      const double depth = std::min(falling.shell->outer_radius, down > 0 ? falling.shell->outer_floor / down
                                                                          : falling.shell->outer_radius);
      lowest = std::min(lowest, depth * d.y());
    }
  CHECK(falling.centre.y() - falling.radius.y() < 0.97 * lowest);
  Capture below = capture, nobody = capture;  // the camera below the floor; no person
  for (Eigen::Vector3d& translation : below.human->poses.translation) translation.y() = 1;
  nobody.human.reset();
  CHECK(!scene_space(below, {.shape = "shell"}).shell->has_floor());
  CHECK(!scene_space(nobody, {.shape = "shell"}).shell->has_floor());
  CHECK(without.centre.y() - without.radius.y() < -4);

  // The samples of a ray that looks down, from the camera and from a metre beside and below it.
  Device& device = test_device();
  ParameterStore store;
  const SceneModel scene(device, store, Initializer(3),
                         {.encoding = Encoding::vanilla, .plane_size = 16, .channels = 16}, space, 16);
  store.allocate(device);
  Graph graph;
  const double half = std::sqrt(0.5);
  const Rays rays{graph.constant({3, 3}, std::vector<double>{0, 0, 0, 1, -1, 0, 1, -1, 0}),
                  graph.constant({3, 3}, std::vector<double>{0, -half, -half, 0, -half, -half, 0, 0, -1})};
  const Value drawn = scene.sample(graph, scene.field().planes(graph), rays, nullptr).depths;
  Run run(graph, {drawn});
  const std::vector<float> depths = run.read(drawn);
  CHECK(depths[0] == doctest::Approx(1.5 / half).epsilon(0.01));
  CHECK(depths[15] == doctest::Approx(1.05 * 1.5 / half).epsilon(0.01));
  CHECK(depths[16] == doctest::Approx(0.5 / half).epsilon(0.02));
  const double radius = space.near;  // of the ball around the camera, not around the ray's origin
  CHECK(depths[32] > std::sqrt(radius * radius - 2) - 1e-3);
  CHECK(depths[32] < std::sqrt(radius * radius - 2) + 0.1 * radius);
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
