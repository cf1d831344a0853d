#include "vivant/ops/body_skinning.hpp"

#include <algorithm>
#include <cmath>

#include "io_helpers.hpp"
#include "vivant/data/motion.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;

TEST_CASE("body_skinning: agrees with the double-precision oracle") {
  const auto oracle_path = shared_data("oracles/lbs_dance_frames.safetensors");
  const auto body_path = shared_data("body/body.safetensors");
  const auto motion_path = shared_data("motions/motion_dance_cmu_05_06.safetensors");
  if (oracle_path.empty() || body_path.empty() || motion_path.empty()) return;
  const Body body = load_body(body_path);
  const Motion motion = load_poses(motion_path);
  const TensorFile oracle = read_safetensors(oracle_path);
  const auto frames = oracle.at("frames", {-1}).as_ints();
  const auto expected = oracle.finite_doubles("verts", {-1, -1, 3});
  const auto vertex_count = static_cast<std::int64_t>(body.vertices.size());

  Device device;
  Graph graph;
  const Value rest = graph.input("rest", {vertex_count, 3});
  const Value transforms = graph.input("transforms", {body.joint_count(), 12});
  const Value joints = graph.input("joints", {vertex_count, body.influences}, DType::i32);
  const Value weights = graph.input("weights", {vertex_count, body.influences});
  const Value posed = body_skinning(rest, transforms, joints, weights).vertices;
  Executor executor(device, graph, {posed});
  executor.write(rest, std::span<const double>(body.vertices[0].data(), 3 * body.vertices.size()));
  executor.write(joints, std::span<const std::int32_t>(body.skin_joints));
  executor.write(weights, std::span<const double>(body.skin_weights));
  double worst = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::vector<double> rows;
    for (const RigidTransform& t :
         joint_transforms(body, motion.pose[frames[i]], motion.translation[frames[i]]))
      for (int r = 0; r < 3; ++r) rows.insert(rows.end(), {t(r, 0), t(r, 1), t(r, 2), t(r, 3)});
    executor.write(transforms, std::span<const double>(rows));
    executor.run();
    const auto got = executor.read_doubles(posed);
    for (std::size_t e = 0; e < got.size(); ++e)
      worst = std::max(worst, std::abs(got[e] - expected[i * got.size() + e]));
  }
  MESSAGE("largest difference to the oracle: ", worst, " m");
  CHECK(worst < 1e-5);
}
