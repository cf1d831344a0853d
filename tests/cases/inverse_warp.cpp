#include <Eigen/Dense>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::int64_t vertices = 23, faces = 17;

// sizes: points, with directions, live points (-1: all). Transforms are near rotations; the last vertex' map
// is singular.
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t n = v.sizes[0];
  std::vector<HostTensor> in = {random.tensor({n, 3}),     random.tensor({n, 3}),
                                random.tensor({n, 1}),     random.tensor({n, 3}, 0.1, 1),
                                random.tensor({faces, 3}), random.tensor({vertices, 12}, -0.1, 0.1)};
  in[1].absent = v.sizes[1] == 0;
  in[2].dtype = in[4].dtype = DType::i32;
  in[3].differentiable = false;
  for (double& face : in[2].data) face = static_cast<double>(random.integer(faces + 2) - 1);
  for (double& face : in[2].data) face = std::min<double>(face, faces - 1);
  for (double& vertex : in[4].data) vertex = static_cast<double>(random.integer(vertices - 1));
  for (int k = 0; k < 3; ++k) in[4].data[in[4].data.size() - 1 - k] = vertices - 1;
  for (std::int64_t i = 0; i < n; ++i) {
    double* b = in[3].data.data() + 3 * i;
    const double sum = b[0] + b[1] + b[2];
    for (int k = 0; k < 3; ++k) b[k] /= sum;
  }
  for (std::int64_t vertex = 0; vertex < vertices - 1; ++vertex)
    for (int k = 0; k < 3; ++k) in[5].data[12 * vertex + 5 * k] += 1;
  if (v.sizes[2] >= 0)
    for (int k : {0, 1, 2, 3}) in[k].live_rows = v.sizes[2];
  return in;
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t n = v.sizes[0], live = v.sizes[2] < 0 ? n : v.sizes[2];
  HostTensor points, inside, directions;
  points.shape = directions.shape = {n, 3};
  inside.shape = {n, 1};
  const auto append = [](HostTensor& tensor, const Vector3d& x) {
    tensor.data.insert(tensor.data.end(), {x.x(), x.y(), x.z()});
  };
  for (std::int64_t i = 0; i < live; ++i) {
    Eigen::Matrix<double, 3, 4> blend = Eigen::Matrix<double, 3, 4>::Zero();
    const auto face = static_cast<std::int64_t>(in[2].data[i]);
    for (int k = 0; face >= 0 && k < 3; ++k) {
      const auto vertex = static_cast<std::int64_t>(in[4].data[3 * face + k]);
      for (int e = 0; e < 12; ++e) blend(e / 4, e % 4) += in[3].data[3 * i + k] * in[5].data[12 * vertex + e];
    }
    const Matrix3d a = blend.leftCols<3>();
    const bool exists = a.determinant() > 0.02;
    inside.data.push_back(exists);
    const Matrix3d inverse = exists ? Matrix3d(a.inverse()) : Matrix3d::Zero();
    append(points, exists ? Vector3d(inverse * (Vector3d(in[0].data.data() + 3 * i) - blend.col(3)))
                          : Vector3d::Constant(1e3));
    append(directions, (inverse * Vector3d(in[1].data.data() + 3 * i)).normalized());
  }
  std::vector<HostTensor> out = {points, inside};
  if (!in[1].absent) out.push_back(directions);
  return out;
}

const Register registration(OpCase{
    .op = "inverse_warp",
    .variations = {{{1, 1, -1}}, {{131, 1, -1}}, {{67, 0, -1}}, {{1100, 1, 1051}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{262144, 1, -1}},
    .flops = [](const Variation& v) { return 150.0 * static_cast<double>(v.sizes[0]); },
    .bytes = [](const Variation& v) { return 4.0 * 17 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
