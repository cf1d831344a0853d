#include "vivant/data/body.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "body_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/data/motion.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;
using Eigen::Vector3d;
using Eigen::Vector3i;

TEST_CASE("body: a bent chain moves as by hand") {
  const Body body = chain_body();
  Pose pose(3, Vector3d::Zero());
  pose[1] = {0, 0, M_PI / 2};  // joint 1 at (0,1,0) turns what is above it to -x
  const auto transforms = joint_transforms(body, pose, {0.5, 0, 0});
  const auto joints = posed_joints(body, transforms);
  CHECK((joints[0] - Vector3d(0.5, 0, 0)).norm() < 1e-15);
  CHECK((joints[1] - Vector3d(0.5, 1, 0)).norm() < 1e-15);
  CHECK((joints[2] - Vector3d(-0.5, 1, 0)).norm() < 1e-15);
  const auto vertices = skin(body, transforms);
  CHECK((vertices[0] - (body.vertices[0] + Vector3d(0.5, 0, 0))).norm() < 1e-15);
  // The last vertex is bound half to joint 1 and half to joint 2, which turn alike.
  const Vector3d last = body.vertices.back();
  CHECK((vertices.back() - Vector3d(0.5 - (last.y() - 1), 1 + last.x(), last.z())).norm() < 1e-15);
  CHECK(contains(error_of([&] { joint_transforms(body, Pose(2), Vector3d::Zero()); }), "2 joints"));
}

TEST_CASE("body: rotations convert both ways") {
  for (const Vector3d& axis_angle :
       {Vector3d(0, 0, 0), Vector3d(1e-9, 0, 0), Vector3d(0.3, -2, 1.1), Vector3d(0, 3.1, 0)}) {
    CHECK((axis_angle_from_rotation(rotation_from_axis_angle(axis_angle)) - axis_angle).norm() < 1e-8);
  }
  const Eigen::Matrix3d quarter = rotation_from_axis_angle({0, 0, M_PI / 2});
  CHECK((quarter * Vector3d::UnitX() - Vector3d::UnitY()).norm() < 1e-15);
}

TEST_CASE("body: shape coefficients move vertices and joints") {
  const Body body = chain_body();
  const std::vector<double> coefficients = {2};
  const Body taller = shaped(body, coefficients);
  CHECK((taller.joints[2] - Vector3d(0, 4, 0)).norm() < 1e-15);
  CHECK((taller.vertices[5] - body.vertices[5] - 2 * body.shape_dirs[0][5]).norm() < 1e-15);
  CHECK(shaped(body, {}).vertices == body.vertices);
  CHECK(contains(error_of([&] { shaped(body, std::vector<double>(2)); }), "2 shape coefficients"));
}

TEST_CASE("body: save and load give the same body") {
  const TemporaryFolder folder;
  const Body body = chain_body();
  save_body(folder / "body.safetensors", body);
  const Body read = load_body(folder / "body.safetensors");
  CHECK(read.vertices == body.vertices);
  CHECK(read.triangles == body.triangles);
  CHECK(read.joints == body.joints);
  CHECK(read.parents == body.parents);
  CHECK(read.joint_names == body.joint_names);
  CHECK(read.skin_joints == body.skin_joints);
  CHECK(read.skin_weights == body.skin_weights);
  CHECK(read.shape_dirs == body.shape_dirs);
  CHECK(read.joint_dirs == body.joint_dirs);
}

TEST_CASE("body: broken files give one clear line") {
  const TemporaryFolder folder;
  save_body(folder / "good.safetensors", chain_body());
  const auto error_after = [&](auto&& change) {
    TensorFile file = read_safetensors(folder / "good.safetensors");
    change(file);
    write_safetensors(folder / "bad.safetensors", file);
    return error_of([&] { load_body(folder / "bad.safetensors"); });
  };
  const auto set_int = [](TensorFile& file, const char* name, std::size_t at, std::int32_t value) {
    std::memcpy(file.tensors.at(name).bytes.data() + 4 * at, &value, 4);
  };
  const auto set_float = [](TensorFile& file, const char* name, std::size_t at, float value) {
    std::memcpy(file.tensors.at(name).bytes.data() + 4 * at, &value, 4);
  };
  CHECK(contains(error_after([](TensorFile& f) { f.tensors.erase("faces"); }), "no tensor 'faces'"));
  CHECK(contains(error_after([](TensorFile& f) { f.metadata.clear(); }), "'joint_names'"));
  CHECK(contains(error_after([&](TensorFile& f) { set_int(f, "faces", 4, 999); }), "vertex 999"));
  CHECK(contains(error_after([&](TensorFile& f) { set_int(f, "parents", 1, 2); }), "joint 1 has parent 2"));
  CHECK(contains(error_after([&](TensorFile& f) { set_int(f, "parents", 2, -1); }), "joint 2 has parent -1"));
  CHECK(contains(error_after([&](TensorFile& f) { set_int(f, "skin_idx", 3, 7); }), "joint 7 of 3"));
  CHECK(contains(error_after([&](TensorFile& f) { set_float(f, "skin_w", 0, 0.5f); }), "sum to"));
  CHECK(contains(error_after([&](TensorFile& f) { set_float(f, "v_template", 7, NAN); }),
                 "'v_template' holds nan"));
  CHECK(contains(error_of([&] { load_body(folder / "body.obj"); }), ".safetensors"));
}

TEST_CASE("body: normals of a box point outwards") {
  const Body body = chain_body();
  const Vector3d centre(0, 1.5, 0);
  const auto normals = vertex_normals(body.vertices, body.triangles);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    CHECK(normals[v].norm() == doctest::Approx(1));
    CHECK(normals[v].dot(body.vertices[v] - centre) > 0);
  }
}

TEST_CASE("body: the canonical pose turns the legs out") {
  const auto path = shared_data("body/body.safetensors");
  if (path.empty()) return;
  const Body body = load_body(path);
  CHECK(body.vertices.size() == 13380);
  CHECK(body.joint_count() == 31);
  CHECK(body.influences == 4);
  CHECK(body.uv_triangles.size() == body.triangles.size());
  const Pose pose = canonical_pose(body, {.leg_angle = 0.5, .arm_angle = 0.25});
  const auto joints = posed_joints(body, joint_transforms(body, pose, Vector3d::Zero()));
  for (const auto& [name, side] : {std::pair{"Left", 1.0}, std::pair{"Right", -1.0}}) {
    const int foot = body.find_joint(std::string(name) + "Foot"),
              hand = body.find_joint(std::string(name) + "Hand");
    CHECK(side * (joints[foot].x() - body.joints[foot].x()) > 0.3);
    CHECK(joints[hand].y() - body.joints[hand].y() > 0.05);
  }
  CHECK(canonical_pose(body)[body.find_joint("LeftArm")].isZero());
}

TEST_CASE("body: skinning agrees with the double-precision oracle") {
  const auto oracle_path = shared_data("oracles/lbs_dance_frames.safetensors");
  const auto body_path = shared_data("body/body.safetensors");
  const auto motion_path = shared_data("motions/motion_dance_cmu_05_06.safetensors");
  if (oracle_path.empty() || body_path.empty() || motion_path.empty()) return;
  const Body body = load_body(body_path);
  const Motion motion = load_poses(motion_path);
  const TensorFile oracle = read_safetensors(oracle_path);
  const auto frames = oracle.at("frames", {-1}).as_ints();
  const auto expected = oracle.finite_doubles("verts", {-1, -1, 3});
  double worst = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto transforms = joint_transforms(body, motion.pose[frames[i]], motion.translation[frames[i]]);
    const auto vertices = skin(body, transforms);
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const double* at = expected.data() + 3 * (i * vertices.size() + v);
      worst = std::max(worst, (vertices[v] - Vector3d(at[0], at[1], at[2])).norm());
    }
  }
  MESSAGE("largest distance to the oracle: ", worst, " m");
  CHECK(worst < 1e-5);
}
