#include <Eigen/Dense>

#include "cases/bumpy_sphere.hpp"
#include "cases/op_case.hpp"
#include "vivant/data/inside_mesh.hpp"
#include "vivant/ops/human_samples.hpp"

namespace vivant::cases {
namespace {

using Eigen::Vector3d;

HostTensor reals(Shape shape) {
  HostTensor tensor;
  tensor.shape = std::move(shape);
  tensor.differentiable = false;
  return tensor;
}

void append(HostTensor& tensor, const Vector3d& x) {
  tensor.data.insert(tensor.data.end(), {x.x(), x.y(), x.z()});
}

// sizes: subdivisions, rays of the table, live rays (-1: all), picked rays, with jitter
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const TriangleMesh mesh = bumpy_sphere(static_cast<int>(v.sizes[0]));
  const MeshTopology topology = mesh_topology(mesh.vertices, mesh.triangles);
  HostTensor origins = reals({v.sizes[1], 3}), directions = origins;
  const auto inside_unit_ball = [&] {
    return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  };
  for (int i = 0; i < v.sizes[1]; ++i) {
    const Vector3d origin = 2.5 * inside_unit_ball(), target = random.uniform(0, 1.5) * inside_unit_ball();
    append(origins, origin);
    append(directions, (target - origin).normalized());
  }
  origins.live_rows = directions.live_rows = v.sizes[2];
  HostTensor vertices = reals({topology.vertex_count, 3}), transforms = reals({topology.vertex_count, 12});
  for (const Vector3d& p : mesh.vertices) {
    append(vertices, p);
    for (int e = 0; e < 12; ++e)
      transforms.data.push_back((e % 5 == 0 ? 1 : 0) + 0.2 * std::sin(p.x() + 2 * p.y() - p.z() + e));
  }
  std::vector<std::int32_t> picked(v.sizes[3]);
  for (std::int32_t& ray : picked) ray = static_cast<std::int32_t>(random.integer(v.sizes[1]));
  HostTensor jitter = random.tensor({v.sizes[3], 1}, 0, 1);
  jitter.absent = v.sizes[4] == 0;
  jitter.differentiable = false;
  return {origins,
          directions,
          vertices,
          transforms,
          integer_rows(topology.triangles, 3),
          integer_rows(topology.leaf_triangles, MeshTopology::width),
          integer_rows(topology.neighbours, 3),
          integer_rows(topology.corner_offsets, 1),
          integer_rows(topology.corners, 1),
          integer_rows(picked, 1),
          jitter};
}

struct Sample {
  int step;
  double signed_distance;
  Vector3d canonical, direction;
};

// Every step of the ray, with no skipping.
std::vector<Sample> march(const TriangleMesh& mesh, const InsideMesh& inside, const HostTensor& transforms,
                          const Vector3d& origin, const Vector3d& direction, const Variation& v) {
  const double step = v.attributes.at("step"), threshold = v.attributes.at("threshold");
  std::vector<Sample> samples;
  for (int k = 0; k * step < 5; ++k) {
    const Vector3d at = origin + (k + 0.5) * step * direction;
    const NearestTriangle nearest = nearest_triangle(at, mesh.vertices, mesh.triangles);
    if (nearest.distance >= threshold) continue;
    const auto& t = mesh.triangles[nearest.face];
    Eigen::Matrix3d corners;
    corners << mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]];
    const Vector3d weights = corners.colPivHouseholderQr().solve(nearest.point);
    Eigen::Matrix<double, 3, 4> blend = Eigen::Matrix<double, 3, 4>::Zero();
    for (int c = 0; c < 3; ++c)
      for (int e = 0; e < 12; ++e) blend(e / 4, e % 4) += weights[c] * transforms.data[12 * t[c] + e];
    const Eigen::Matrix3d inverse = blend.leftCols<3>().inverse();
    samples.push_back({k, (inside.contains(at) ? -1 : 1) * nearest.distance, inverse * (at - blend.col(3)),
                       (inverse * direction).normalized()});
  }
  return samples;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const TriangleMesh mesh = bumpy_sphere(static_cast<int>(v.sizes[0]));
  const InsideMesh inside(mesh.vertices, mesh.triangles);
  const std::int64_t rays = v.sizes[1], live = v.sizes[2] < 0 ? rays : v.sizes[2], picked = v.sizes[3];
  const std::int64_t most = v.attributes.at("samples_per_ray");
  const double step = v.attributes.at("step");
  std::vector<std::vector<Sample>> samples(rays);
  HostTensor offsets = integer_rows({0}, 1);
  for (std::int64_t r = 0; r < rays; ++r) {
    if (r < live)
      samples[r] = march(mesh, inside, in[3], Vector3d(in[0].data.data() + 3 * r),
                         Vector3d(in[1].data.data() + 3 * r), v);
    if (static_cast<std::int64_t>(samples[r].size()) > most) samples[r].resize(most);
    offsets.data.push_back(offsets.data.back() + static_cast<double>(samples[r].size()));
  }
  offsets.shape = {rays + 1, 1};
  HostTensor points = reals({picked * most, 3}), distances = reals({picked * most, 1});
  HostTensor depths = reals({picked, most}), deltas = depths;
  for (std::int64_t b = 0; b < picked; ++b) {
    const auto& own = samples[static_cast<std::size_t>(in[9].data[b])];
    const double shift = in[10].absent ? 0 : (in[10].data[b] - 0.5) * step;
    for (const Sample& sample : own) {
      append(points, sample.canonical + shift * sample.direction);
      distances.data.push_back(sample.signed_distance);
      depths.data.push_back((sample.step + 0.5) * step + shift);
      deltas.data.push_back(step);
    }
    depths.data.resize((b + 1) * most, no_sample_depth);
    deltas.data.resize((b + 1) * most, 0);
  }
  return {points, distances, depths, deltas, offsets};
}

// The third variation cuts rays off; the directions' 16 bits show in jittered points.
const Register human_samples(OpCase{
    .op = "human_samples",
    .variations = {{{2, 1, -1, 1, 0}, {{"step", 0.11}, {"threshold", 0.2}, {"samples_per_ray", 20}}},
                   {{3, 23, 19, 31, 1}, {{"step", 0.05}, {"threshold", 0.1}, {"samples_per_ray", 40}}},
                   {{2, 17, -1, 9, 0}, {{"step", 0.03}, {"threshold", 0.12}, {"samples_per_ray", 6}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{6, 16384, -1, 16384, 1},
                  {{"step", 0.0075}, {"threshold", 0.08}, {"samples_per_ray", 100}}},
    .bytes = [](const Variation& v) { return 4.0 * 24 * static_cast<double>(v.sizes[1]); },
});

}  // namespace
}  // namespace vivant::cases
