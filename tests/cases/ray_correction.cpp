#include <Eigen/Geometry>

#include "cases/op_case.hpp"

namespace vivant::cases {
namespace {

// sizes: rays, frames, live rays (-1: all)
std::vector<HostTensor> rays_and_corrections(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], frames = v.sizes[1];
  const auto frame_pixels = v.attributes["frame_pixels"].get<std::int64_t>();
  HostTensor pixels = fixed_tensor(DType::i32, {rays, 1});
  for (std::int64_t r = 0; r < rays; ++r)
    pixels.data.push_back(static_cast<double>(random.integer(frames * frame_pixels)));
  std::vector<HostTensor> in = {random.tensor({rays, 3}), random.tensor({rays, 3}), pixels,
                                random.tensor({frames, 6})};
  in[0].differentiable = in[1].differentiable = false;
  for (int i : {0, 1, 2}) in[i].live_rows = v.sizes[2];
  return in;
}

// The rotation by its angle and axis, not by the kernel's formula.
std::vector<HostTensor> turned_and_moved(const Variation& v, const std::vector<HostTensor>& in) {
  const auto frame_pixels = v.attributes["frame_pixels"].get<std::int64_t>();
  HostTensor origins, directions;
  origins.shape = directions.shape = {v.sizes[0], 3};
  for (std::int64_t r = 0; r < (v.sizes[2] < 0 ? v.sizes[0] : v.sizes[2]); ++r) {
    const double unit = v.attributes.value("unit", 1.0);
    const double* code = &in[3].data[6 * (static_cast<std::int64_t>(in[2].data[r]) / frame_pixels)];
    const Eigen::Vector3d turn(code), move(code + 3), o(&in[0].data[3 * r]), d(&in[1].data[3 * r]);
    const Eigen::Vector3d turned = Eigen::AngleAxisd(2 * std::atan(turn.norm() / 2), turn.normalized()) * d;
    for (int i = 0; i < 3; ++i) {
      origins.data.push_back(o[i] + unit * move[i]);
      directions.data.push_back(turned[i]);
    }
  }
  return {origins, directions};
}

const Register registration(OpCase{
    .op = "ray_correction",
    .variations = {{{1, 1, -1}, {{"frame_pixels", 5}}},
                   {{67, 3, 50}, {{"frame_pixels", 11}, {"unit", 2.5}}},
                   {{2111, 7, -1}, {{"frame_pixels", 35}}}},
    .inputs = rays_and_corrections,
    .reference = turned_and_moved,
    .benchmark = {{4096, 64, -1}, {{"frame_pixels", 65536}}},
    .flops = [](const Variation& v) { return 45.0 * static_cast<double>(v.sizes[0]); },
    .bytes = [](const Variation& v) { return 52.0 * static_cast<double>(v.sizes[0]); },
});

}  // namespace
}  // namespace vivant::cases
