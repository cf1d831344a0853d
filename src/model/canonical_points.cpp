#include "vivant/model/canonical_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "vivant/graph/executor.hpp"
#include "vivant/ops/concat.hpp"
#include "vivant/ops/gather.hpp"

namespace vivant {
namespace {

constexpr std::int64_t box_bank = 1 << 16, line_bank = 1 << 10, pair_bank = 1 << 14;
constexpr double farthest = 0.2;         // metres: nothing asks for more
constexpr double surface_spread = 0.01;  // metres along the normal
constexpr double pair_distance = 0.02;   // metres on each axis

std::shared_ptr<Buffer> uploaded(Device& device, const std::vector<float>& data) {
  auto buffer = std::make_shared<Buffer>(device.allocate(data.size() * sizeof(float)));
  device.write(*buffer, data.data(), data.size() * sizeof(float));
  return buffer;
}

Value bank(Graph& graph, const std::string& name, Shape shape, const std::shared_ptr<Buffer>& buffer) {
  return graph.named(name, [&] { return graph.external(name, {DType::real, shape}, {buffer, 0}); });
}

/// Numbers that are the same on every platform.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : generator_(seed) {}
  double uniform() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53; }
  double normal() { return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform()); }
  Eigen::Vector3d within(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    Eigen::Vector3d point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = low[axis] + (high[axis] - low[axis]) * uniform();
    return point;
  }
  Eigen::Vector3d normals() {
    Eigen::Vector3d v;
    for (double& x : v) x = normal();
    return v;
  }

 private:
  std::mt19937_64 generator_;
};

/// Random places on a mesh, uniform by area: vertices are dense in the face and the hands.
class SurfacePlaces {
 public:
  SurfacePlaces(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles)
      : vertices_(vertices), triangles_(triangles) {
    double sum = 0;
    for (const Eigen::Vector3i& t : triangles) areas_.push_back(sum += normal_of(t).norm());
  }
  struct Place {
    Eigen::Vector3d position, normal;
  };
  Place draw(Dice& dice) const {
    const auto at = std::lower_bound(areas_.begin(), areas_.end(), dice.uniform() * areas_.back());
    const Eigen::Vector3i& t = triangles_[at - areas_.begin()];
    const double side = std::sqrt(dice.uniform()), along = dice.uniform();
    return {(1 - side) * vertices_[t[0]] + side * ((1 - along) * vertices_[t[1]] + along * vertices_[t[2]]),
            normal_of(t).normalized()};
  }

 private:
  Eigen::Vector3d normal_of(const Eigen::Vector3i& t) const {
    return (vertices_[t[1]] - vertices_[t[0]]).cross(vertices_[t[2]] - vertices_[t[0]]);
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  const std::vector<Eigen::Vector3i>& triangles_;
  std::vector<double> areas_;  // of all triangles up to each, twice
};

void append(std::vector<float>& numbers, const Eigen::Vector3d& v) {
  for (const double x : v) numbers.push_back(static_cast<float>(x));
}

}  // namespace

std::vector<float> canonical_distances(Device& device, const BodyModel& body,
                                       const std::vector<float>& points, double most) {
  constexpr std::int64_t tile = 1 << 14;
  Graph graph;
  const Value queries = graph.input("points", {tile, 3});
  const Value distance = closest_point(queries, body.canonical_mesh(graph), most).signed_distance;
  Executor executor(device, graph, {distance});
  std::vector<float> distances;
  const auto count = static_cast<std::int64_t>(points.size() / 3);
  for (std::int64_t first = 0; first < count; first += tile) {
    const std::int64_t live = std::min(tile, count - first);
    std::vector<float> part(points.begin() + 3 * first, points.begin() + 3 * (first + live));
    part.resize(3 * tile, 0.0f);
    executor.write(queries, std::span<const float>(part));
    executor.run();
    const std::vector<float> read = executor.read(distance);
    distances.insert(distances.end(), read.begin(), read.begin() + live);
  }
  return distances;
}

CanonicalPoints::CanonicalPoints(Device& device, const HumanModel& model, std::uint64_t seed) {
  Dice dice(seed);
  const Eigen::Vector3d &low = model.body().canonical_box().min, &high = model.body().canonical_box().max;
  std::vector<float> points, on_lines, lengths, pairs;
  for (std::int64_t i = 0; i < box_bank; ++i) append(points, dice.within(low, high));
  for (std::int64_t i = 0; i < line_bank; ++i) {
    const Eigen::Vector3d from = dice.within(low, high), to = dice.within(low, high);
    for (std::int64_t k = 0; k < line_points; ++k)
      append(on_lines, from + (to - from) * ((static_cast<double>(k) + 0.5) / line_points));
    lengths.insert(lengths.end(), line_points, static_cast<float>((to - from).norm() / line_points));
  }
  const SurfacePlaces surface(model.body().canonical_vertices(), model.body().body().triangles);
  for (std::int64_t i = 0; i < pair_bank; ++i) {
    const SurfacePlaces::Place place = surface.draw(dice);
    const Eigen::Vector3d a = place.position + surface_spread * dice.normal() * place.normal;
    append(pairs, a);
    append(pairs, a + pair_distance * dice.normals());
  }
  points_ = uploaded(device, points);
  distances_ = uploaded(device, canonical_distances(device, model.body(), points, farthest));
  line_points_ = uploaded(device, on_lines);
  line_distances_ = uploaded(device, canonical_distances(device, model.body(), on_lines, farthest));
  line_lengths_ = uploaded(device, lengths);
  pairs_ = uploaded(device, pairs);
}

CanonicalPoints::Points CanonicalPoints::box(Graph& graph, std::int64_t count, const RandomKey& key) const {
  const Value ids = random_integers({count}, box_bank, key);
  return {gather_rows(bank(graph, "box points", {box_bank, 3}, points_), ids),
          gather_rows(bank(graph, "box distances", {box_bank, 1}, distances_), ids)};
}

CanonicalPoints::Lines CanonicalPoints::lines(Graph& graph, std::int64_t count, const RandomKey& key) const {
  const Value ids = random_integers({count}, line_bank, key);
  const auto rows = [&](const std::string& name, std::int64_t columns,
                        const std::shared_ptr<Buffer>& buffer) {
    return gather_rows(bank(graph, name, {line_bank, columns}, buffer), ids);
  };
  return {{graph.reshape(rows("line points", 3 * line_points, line_points_), {count * line_points, 3}),
           graph.reshape(rows("line distances", line_points, line_distances_), {count * line_points, 1})},
          rows("line lengths", line_points, line_lengths_)};
}

CanonicalPoints::SurfacePairs CanonicalPoints::surface(Graph& graph, std::int64_t count,
                                                       const RandomKey& key) const {
  const Value pairs = gather_rows(bank(graph, "surface pairs", {pair_bank, 6}, pairs_),
                                  random_integers({count}, pair_bank, key));
  return {slice(pairs, 1, 0, 3), slice(pairs, 1, 3, 3)};
}

}  // namespace vivant
