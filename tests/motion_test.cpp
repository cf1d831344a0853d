#include "vivant/data/motion.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "body_helpers.hpp"
#include "io_helpers.hpp"
#include "npz_helpers.hpp"
#include "vivant/data/retarget.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/bvh.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

Motion turning_motion() {
  Motion motion{
      .fps = 10, .joint_names = {"root", "middle", "top"}, .pose = {}, .translation = {}, .shape = {}};
  for (int i = 0; i < 11; ++i) {
    motion.pose.push_back({Vector3d(0, 0.1 * i, 0), Vector3d(0.02 * i, 0, 0), Vector3d::Zero()});
    motion.translation.emplace_back(0.3 * i, 0.5, 0);
  }
  return motion;
}

const char* const small_bvh =
    "HIERARCHY\nROOT Hips\n{\n OFFSET 0 10 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
    "Xrotation\n"
    " JOINT Knee\n {\n  OFFSET 0 -5 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   "
    "OFFSET 0 -5 0\n"
    "  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n1 10 2 90 0 0 0 0 0\n1 11 2 0 90 90 30 0 0\n";

}  // namespace

TEST_CASE("motion: poses survive a round trip and resampling") {
  const TemporaryFolder folder;
  Motion motion = turning_motion();
  motion.shape = {0.5, -1};
  save_poses(folder / "a.safetensors", motion);
  const Motion read = load_poses(folder / "a.safetensors");
  CHECK(read.fps == 10);
  CHECK(read.shape == motion.shape);
  CHECK(read.joint_names == motion.joint_names);
  REQUIRE(read.frame_count() == 11);
  CHECK((read.pose[7][0] - motion.pose[7][0]).norm() < 1e-7);
  const Motion faster = resampled(motion, 25);
  REQUIRE(faster.frame_count() == 26);
  CHECK(faster.pose[1][0].y() == doctest::Approx(0.04));
  CHECK(faster.translation[25].x() == doctest::Approx(3));
  const Motion same = resampled(motion, 10.0000001);
  CHECK(same.frame_count() == 11);
  // Half-way between two rotations lies on the shortest arc, across the turn at 180 degrees too.
  Motion across = motion;
  across.pose = {{Vector3d(0, 3.0, 0)}, {Vector3d(0, -3.0, 0)}};
  across.translation.resize(2);
  CHECK(std::abs(resampled(across, 20).pose[1][0].norm() - M_PI) < 1e-9);
}

TEST_CASE("motion: a pose that is not finite names file, frame and joint") {
  Motion motion = turning_motion();
  motion.pose[4][1].x() = NAN;
  CHECK(error_of([&] { check_motion(motion, 3, "poses.safetensors"); }) ==
        "poses.safetensors: the pose of frame 4, joint 1 (middle) is not finite");
  motion = turning_motion();
  motion.translation[2].z() = INFINITY;
  CHECK(contains(error_of([&] { check_motion(motion, 3, "p"); }), "the translation of frame 2"));
  CHECK(contains(error_of([&] { check_motion(turning_motion(), 4, "p"); }),
                 "frame 0 has 3 joints, the body has 4"));
  CHECK(contains(error_of([&] { check_motion(Motion{}, 4, "p"); }), "no pose"));
}

TEST_CASE("motion: placing sets position, ground and heading") {
  const Body body = chain_body();
  const Motion motion = turning_motion();
  const Placement there{.x = 4, .y = -2, .z = 7, .yaw = 90};
  const Motion moved = placed(body, motion, there);
  const Placement start = standing_at(body, moved);
  CHECK(start.x == doctest::Approx(4));
  CHECK(start.y == doctest::Approx(-2));
  CHECK(start.z == doctest::Approx(7));
  CHECK(start.yaw == doctest::Approx(90));
  // A rigid move: what went along +x now goes along -z, and distances between frames stay.
  const Vector3d step = moved.translation[1] - moved.translation[0];
  CHECK((step - Vector3d(0, 0, -0.3)).norm() < 1e-12);
  CHECK((moved.pose[5][1] - motion.pose[5][1]).norm() < 1e-12);
  CHECK(heading({0, -M_PI / 2, 0}) == doctest::Approx(-90));
  // Placed where it stands, nothing moves.
  const Motion still = placed(body, motion, standing_at(body, motion));
  for (int i = 0; i < 11; ++i) CHECK((still.translation[i] - motion.translation[i]).norm() < 1e-12);
}

TEST_CASE("motion: the ground is where feet stand, whatever jumps and fits that sink too deep") {
  Motion motion;
  for (int i = 0; i < 100; ++i) {
    const double wave = 0.004 * (i % 5);
    const double height = i < 20   ? -0.3 + 0.015 * i         // fitted too deep
                          : i < 60 ? 0.2 + wave               // standing
                                   : 0.25 + 0.02 * (i - 60);  // jumping
    motion.pose.push_back(Pose(3, Vector3d::Zero()));
    motion.translation.emplace_back(0, height, 0);
  }
  CHECK(ground_height(chain_body(), motion) == doctest::Approx(0.208).epsilon(0.02));
  motion.pose.resize(1);
  motion.translation = {{0, 0.7, 0}};
  CHECK(ground_height(chain_body(), motion) == doctest::Approx(0.7));
}

TEST_CASE("bvh: channels, offsets and frames") {
  const TemporaryFolder folder;
  write_file(folder / "a.bvh", small_bvh);
  const SkeletonMotion motion = read_bvh(folder / "a.bvh");
  CHECK(motion.joint_names == std::vector<std::string>{"Hips", "Knee"});
  CHECK(motion.parents == std::vector<int>{-1, 0});
  CHECK(motion.rest_positions[1] == Vector3d(0, 5, 0));
  CHECK(motion.fps == doctest::Approx(25));
  CHECK(motion.root_positions[1] == Vector3d(1, 11, 2));
  // Channels act from left to right: Rz Ry Rx.
  CHECK((motion.rotations[0][0] * Vector3d::UnitX() - Vector3d::UnitY()).norm() < 1e-12);
  CHECK((motion.rotations[1][0] * Vector3d::UnitY() - Vector3d::UnitX()).norm() < 1e-12);
  const std::string text = small_bvh;
  for (std::size_t size = 0; size + 2 < text.size(); size += 3) {
    write_file(folder / "cut.bvh", text.substr(0, size));
    CHECK(contains(error_of([&] { read_bvh(folder / "cut.bvh"); }), "cut.bvh: line "));
  }
  const auto error_with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    write_file(folder / "bad.bvh", changed);
    return error_of([&] { read_bvh(folder / "bad.bvh"); });
  };
  CHECK(contains(error_with("Zrotation", "Wrotation"), "line 5: unknown channel 'Wrotation'"));
  CHECK(contains(error_with("Frames: 2", "Frames: 3"), "cut short"));
  CHECK(contains(error_with("Frames: 2", "Frames: 0"), "no frames"));
  CHECK(contains(error_with("0.04", "0"), "frame time"));
  CHECK(contains(error_with("1 11 2", "1 nan 2"), "line 20: 'nan' is not a finite number"));
  CHECK(contains(error_with("-5", "five"), "'five'"));
}

TEST_CASE("motion: BVH clips retarget as the reference does") {
  const auto body_path = shared_data("body/body.safetensors");
  if (body_path.empty() || shared_data("motions").empty()) return;
  const Body body = load_body(body_path);
  for (const auto& [clip, reference] :
       {std::pair{"02_01", "walk_cmu_02_01"}, std::pair{"05_06", "dance_cmu_05_06"}}) {
    const Motion expected =
        load_poses(shared_data(std::string("motions/motion_") + reference + ".safetensors"));
    const Motion motion = load_motion(shared_data(std::string("motions/") + clip + ".bvh"), body);
    CHECK(motion.fps == doctest::Approx(120).epsilon(1e-3));
    double worst_angle = 0, worst_step = 0;
    for (int f = 0; f < expected.frame_count(); ++f) {
      for (int j = 0; j < body.joint_count(); ++j) {
        const Eigen::Matrix3d difference = rotation_from_axis_angle(motion.pose[4 * f][j]).transpose() *
                                           rotation_from_axis_angle(expected.pose[f][j]);
        worst_angle = std::max(worst_angle, Eigen::AngleAxisd(difference).angle());
      }
      const Vector3d shift = motion.translation[4 * f] - expected.translation[f];
      const Vector3d first = motion.translation[0] - expected.translation[0];
      worst_step = std::max(worst_step, (shift - first).norm());
    }
    // The reference puts its ground elsewhere: heights differ by a constant.
    const double lift = motion.translation[0].y() - expected.translation[0].y();
    MESSAGE(std::string(clip), ": largest rotation error ", worst_angle, " rad, path ", worst_step,
            " m, height differs by ", lift, " m");
    CHECK(worst_angle < 1e-5);
    CHECK(worst_step < 1e-5);
    CHECK(std::abs(ground_height(body, motion)) < 1e-9);
  }
}

TEST_CASE("motion: a mapping file names other joints") {
  const auto body_path = shared_data("body/body.safetensors");
  const auto clip = shared_data("motions/02_01.bvh");
  if (body_path.empty() || clip.empty()) return;
  const TemporaryFolder folder;
  const Body body = load_body(body_path);
  std::string text = read_whole_file(clip);
  for (const auto& [from, to] :
       {std::pair{"JOINT LeftUpLeg\r", "JOINT thigh.L\r"}, {"JOINT LeftUpLeg\n", "JOINT thigh.L\n"}}) {
    if (const std::size_t at = text.find(from); at != std::string::npos)
      text.replace(at, std::string(from).size(), to);
  }
  write_file(folder / "other.bvh", text);
  CHECK(contains(error_of([&] { load_motion(folder / "other.bvh", body); }),
                 "no joint for the body's 'LeftUpLeg'"));
  write_file(folder / "map.json", R"({"LeftUpLeg": "thigh.L"})");
  CHECK(load_motion(folder / "other.bvh", body, folder / "map.json").pose == load_motion(clip, body).pose);
  write_file(folder / "map.json", R"({"LeftUpLeg": "thigh.R"})");
  CHECK(
      contains(error_of([&] { load_motion(folder / "other.bvh", body, folder / "map.json"); }), "'thigh.R'"));
  write_file(folder / "map.json", R"({"Thigh": "thigh.L"})");
  CHECK(contains(error_of([&] { load_motion(folder / "other.bvh", body, folder / "map.json"); }),
                 "no such joint"));
  write_file(folder / "map.json", R"(["LeftUpLeg"])");
  CHECK(
      contains(error_of([&] { load_motion(folder / "other.bvh", body, folder / "map.json"); }), "map.json"));
  CHECK_THROWS_AS(load_motion(folder / "a.fbx", body), UsageError);
}

TEST_CASE("motion: an AMASS archive turns z up to y up and stands on the ground") {
  const auto body_path = shared_data("body/body.safetensors");
  if (body_path.empty()) return;
  const TemporaryFolder folder;
  const Body body = load_body(body_path);
  // Three frames of SMPL-H: upright (a quarter turn about x), walking along +x, the left knee bent by 1 rad.
  std::vector<double> poses(3 * 156), positions = {0, 0, 0.9, 0.5, 0, 0.9, 1, 0, 0.9};
  for (int f = 0; f < 3; ++f) {
    poses[f * 156] = M_PI / 2;
    poses[f * 156 + 3 * 4] = 1;
  }
  const auto write = [&](const std::vector<double>& values) {
    write_file(folder / "a.npz", zip_bytes({{"poses.npy", npy_bytes("<f8", "(3, 156)", values)},
                                            {"trans.npy", npy_bytes("<f8", "(3, 3)", positions)},
                                            {"gender.npy", npy_bytes("<U4", "()", std::string(16, 'a'))},
                                            {"mocap_framerate.npy", npy_bytes<double>("<f8", "()", {120})}},
                                           true));
  };
  write(poses);
  const Motion motion = load_motion(folder / "a.npz", body);
  CHECK(motion.fps == 120);
  CHECK(motion.pose[0][0].norm() < 1e-12);  // upright in y up is the rest orientation
  CHECK(std::abs(ground_height(body, motion)) < 1e-9);
  const Vector3d step = motion.translation[1] - motion.translation[0];
  CHECK(step.x() > 0.4);
  CHECK(std::abs(step.z()) < 1e-9);
  const auto joints = posed_joints(body, joint_transforms(body, motion.pose[0], motion.translation[0]));
  const auto at = [&](const char* name) { return joints[body.find_joint(name)]; };
  CHECK(at("LeftArm").x() < at("LeftHand").x() - 0.4);  // T-pose: arms level
  CHECK(std::abs(at("LeftArm").y() - at("LeftHand").y()) < 0.05);
  CHECK(at("LeftFoot").z() < at("RightFoot").z() - 0.2);  // the bent knee takes the foot backwards
  poses[156 + 3 * 7] = NAN;
  write(poses);
  CHECK(contains(error_of([&] { load_motion(folder / "a.npz", body); }), "frame 1, joint 7 (left_ankle)"));
}
