#include <Eigen/Core>
#include <bit>

#include "cases/op_case.hpp"
#include "vivant/ops/human_samples.hpp"

namespace vivant::cases {
namespace {

using Eigen::Vector3d;

double float_bits(double x) { return std::bit_cast<std::int32_t>(static_cast<float>(x)); }
double bits_float(double bits) { return std::bit_cast<float>(static_cast<std::int32_t>(bits)); }
/// Two numbers in [0, 1] of 16 bits each.
std::pair<double, double> pair_of(double bits) {
  const auto pair = static_cast<std::uint32_t>(static_cast<std::int32_t>(bits));
  return {(pair & 0xffff) / 65535.0, (pair >> 16) / 65535.0};
}

// sizes: rays of the table, most samples of one, picked rays, 1 with frames and roots, 1 with jitter
std::vector<HostTensor> inputs(const Variation& v, Random& random) {
  const std::int64_t rays = v.sizes[0], picked = v.sizes[2];
  HostTensor records = fixed_tensor(DType::i32, {}), offsets = fixed_tensor(DType::i32, {rays + 1, 1});
  offsets.data = {0};
  const auto packed_direction = [&] {
    const double high = static_cast<double>(random.integer(65536)) - 32768;  // with the sign
    return 65536 * high + static_cast<double>(random.integer(65536));
  };
  for (std::int64_t r = 0; r < rays; ++r) {
    const std::int64_t count = rays == 1 ? v.sizes[1] : random.integer(v.sizes[1] + 1);
    for (std::int64_t k = 0; k < count; ++k) {
      for (int axis = 0; axis < 3; ++axis) records.data.push_back(float_bits(random.uniform(-2, 2)));
      records.data.push_back(packed_direction());
      records.data.push_back(static_cast<double>(random.integer(13000)));
      records.data.push_back(static_cast<double>(65536 * random.integer(20000) + random.integer(30000)));
      records.data.push_back(float_bits(random.uniform(-0.1, 0.1)));
      records.data.push_back(static_cast<double>(3 * k + random.integer(3)));
      records.data.push_back(packed_direction());
    }
    offsets.data.push_back(offsets.data.back() + static_cast<double>(count));
  }
  records.shape = {static_cast<std::int64_t>(records.data.size()) / sample_record_words, sample_record_words};
  HostTensor frames = fixed_tensor(DType::i32, {rays, 1}), chosen = fixed_tensor(DType::i32, {picked, 1});
  for (std::int64_t r = 0; r < rays; ++r) frames.data.push_back(static_cast<double>(random.integer(7)));
  for (std::int64_t b = 0; b < picked; ++b) chosen.data.push_back(static_cast<double>(random.integer(rays)));
  HostTensor roots = random.tensor({rays, 6}), jitter = random.tensor({picked, 1}, 0, 1);
  roots.differentiable = jitter.differentiable = false;
  frames.absent = roots.absent = v.sizes[3] == 0;
  jitter.absent = v.sizes[4] == 0;
  return {records, offsets, frames, roots, chosen, jitter};
}

Vector3d direction_of(double bits) {
  const auto [first, second] = pair_of(bits);
  const double u = 2 * first - 1, v = 2 * second - 1, z = 1 - std::abs(u) - std::abs(v);
  if (z >= 0) return Vector3d(u, v, z).normalized();
  return Vector3d(std::copysign(1 - std::abs(v), u), std::copysign(1 - std::abs(u), v), z).normalized();
}

void append(HostTensor& tensor, const Vector3d& x) {
  tensor.data.insert(tensor.data.end(), {x.x(), x.y(), x.z()});
}

std::vector<HostTensor> reference(const Variation& v, const std::vector<HostTensor>& in) {
  const std::int64_t picked = v.sizes[2], most = v.attributes.at("samples_per_ray");
  const std::int64_t given = v.attributes.value("capacity", 0), capacity = given > 0 ? given : picked * most;
  const double step = v.attributes.at("step");
  HostTensor points = fixed_tensor(DType::real, {capacity, 3}), directions = points, normals = points,
             root = points, barycentric = points;
  HostTensor distance = fixed_tensor(DType::real, {capacity, 1}),
             face = fixed_tensor(DType::i32, {capacity, 1}), frame = face;
  HostTensor ids = fixed_tensor(DType::i32, {capacity, 1}), overflow = fixed_tensor(DType::i32, {1});
  HostTensor depths = fixed_tensor(DType::real, {picked, most}), deltas = depths;
  HostTensor rows = fixed_tensor(DType::i32, {picked, most});
  overflow.data = {0};
  for (std::int64_t b = 0; b < picked; ++b) {
    const auto ray = static_cast<std::size_t>(in[4].data[b]);
    const double shift = in[5].absent ? 0 : (in[5].data[b] - 0.5) * step;
    for (std::int64_t s = 0; s < most && in[1].data[ray] + s < in[1].data[ray + 1]; ++s) {
      if (static_cast<std::int64_t>(ids.data.size()) == capacity) {
        overflow.data = {1};
        break;
      }
      const double* record =
          in[0].data.data() + sample_record_words * static_cast<std::int64_t>(in[1].data[ray] + s);
      const double depth = (record[7] + 0.5) * step + shift;
      const auto [second, third] = pair_of(record[5]);
      append(directions, direction_of(record[3]));
      append(normals, direction_of(record[8]));
      append(points, Vector3d(bits_float(record[0]), bits_float(record[1]), bits_float(record[2])) +
                         shift * direction_of(record[3]));
      append(barycentric, {1 - second - third, second, third});
      const double* line = in[3].data.data() + 6 * ray;
      append(root, Vector3d(line) + depth * Vector3d(line + 3));
      distance.data.push_back(bits_float(record[6]));
      face.data.push_back(record[4]);
      frame.data.push_back(in[2].absent ? 0 : in[2].data[ray]);
      rows.data.push_back(static_cast<double>(ids.data.size()));
      ids.data.push_back(static_cast<double>(b * most + s));
      depths.data.push_back(depth);
      deltas.data.push_back(step);
    }
    depths.data.resize((b + 1) * most, no_sample_depth);
    deltas.data.resize((b + 1) * most, 0);
    rows.data.resize((b + 1) * most, -1);
  }
  std::vector<HostTensor> out = {points, directions, normals, distance, face, barycentric,
                                 frame,  ids,        depths,  deltas,   rows, overflow};
  if (!in[3].absent) out.push_back(root);
  return out;
}

// The third variation cuts rays off; the rows of the fourth do not fit.
const Register register_gather_samples(OpCase{
    .op = "gather_samples",
    .variations = {{{1, 1, 1, 0, 0}, {{"step", 0.1}, {"samples_per_ray", 1}}},
                   {{23, 17, 31, 1, 1}, {{"step", 0.05}, {"samples_per_ray", 17}}},
                   {{7, 30, 300, 1, 0}, {{"step", 0.03}, {"samples_per_ray", 11}}},
                   {{19, 12, 65, 0, 1}, {{"step", 0.05}, {"samples_per_ray", 12}, {"capacity", 127}}}},
    .inputs = inputs,
    .reference = reference,
    .benchmark = {{65536, 48, 16384, 1, 1}, {{"step", 0.0075}, {"samples_per_ray", 48}}},
    .bytes =
        [](const Variation& v) {
          return 4.0 * (9 + 19) * 0.5 * static_cast<double>(v.sizes[2] * v.sizes[1]);
        },
});

}  // namespace
}  // namespace vivant::cases
