#include "vivant/data/walk.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Values at tenths of the gait cycle, from one landing of the heel to the next.
using GaitCurve = std::array<double, 10>;
constexpr GaitCurve kFootPitch = {-15, -1, 0, 0, 3, 17, 44, 50, 18, -8};  // degrees, heel up
constexpr double kStance = 0.6;        // part of the cycle that a foot stands
constexpr double kStepLength = 0.54;   // metres
constexpr double kFootSpread = 0.085;  // metres from the path to each foot
constexpr double kLift = 0.045;        // metres by which a swinging foot is raised

/// Periodic Catmull-Rom interpolation.
double at_phase(const GaitCurve& curve, double phase) {
  const double position = (phase - std::floor(phase)) * curve.size();
  const int left = static_cast<int>(position);
  const double t = position - left;
  const auto value = [&](int i) { return curve[(left + i + curve.size()) % curve.size()]; };
  const double a = value(-1), b = value(0), c = value(1), d = value(2);
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

Matrix3d turn(double x, double y, double z) {
  return (Eigen::AngleAxisd(y * kDegree, Vector3d::UnitY()) *
          Eigen::AngleAxisd(x * kDegree, Vector3d::UnitX()) *
          Eigen::AngleAxisd(z * kDegree, Vector3d::UnitZ()))
      .toRotationMatrix();
}

/// Sets joints by name: degrees about z, then x, then y of the rest frame.
class PoseBuilder {
 public:
  explicit PoseBuilder(const Body& body) : body_(body), pose_(body.joints.size(), Vector3d::Zero()) {}

  PoseBuilder& set(const std::string& joint, double x, double y, double z) {
    const int index = body_.find_joint(joint);
    if (index < 0) fail("the procedural poses need a joint called '{}', the body has none", joint);
    pose_[index] = axis_angle_from_rotation(turn(x, y, z));
    return *this;
  }
  /// The same on both sides; y and z are mirrored on the right.
  PoseBuilder& both(const std::string& joint, double x, double y, double z) {
    return set("Left" + joint, x, y, z).set("Right" + joint, x, -y, -z);
  }
  const Pose& pose() const { return pose_; }

 private:
  const Body& body_;
  Pose pose_;
};

double lowest_height(const std::vector<Vector3d>& vertices) {
  double lowest = vertices.front().y();
  for (const Vector3d& vertex : vertices) lowest = std::min(lowest, vertex.y());
  return lowest;
}

/// Where the walker is and faces when `time` seconds have passed: an arc of a circle.
class Path {
 public:
  Path(const WalkOptions& options)
      : speed_(kStepLength * options.steps_per_second), start_(options.start_heading * kDegree) {
    const double duration = std::max(1, options.frames - 1) / options.fps;
    rate_ = (options.end_heading - options.start_heading) * kDegree / duration;
  }
  double heading(double time) const { return start_ + rate_ * time; }
  Vector3d position(double time) const {
    if (std::abs(rate_) < 1e-9) return speed_ * time * Vector3d(std::sin(start_), 0, std::cos(start_));
    const double now = heading(time);
    return speed_ / rate_ * Vector3d(std::cos(start_) - std::cos(now), 0, std::sin(now) - std::sin(start_));
  }

 private:
  double speed_, start_, rate_;
};

/// One leg: joints of the body and where its foot is.
class Leg {
 public:
  Leg(const Body& body, const Path& path, const WalkOptions& options, bool left)
      : body_(body), path_(path), side_(left ? 1 : -1), name_(left ? "Left" : "Right") {
    cycle_ = 2 / options.steps_per_second;
    start_ = options.start_phase + (left ? 0 : 0.5);
    for (const char* joint : {"UpLeg", "Leg", "Foot", "ToeBase"}) {
      joints_.push_back(body.find_joint(name_ + joint));
      if (joints_.back() < 0)
        fail("the procedural walk needs a joint called '{}{}', the body has none", name_, joint);
    }
    double ground = body.vertices.front().y();
    for (const Vector3d& vertex : body.vertices) ground = std::min(ground, vertex.y());
    ankle_ = Vector3d(0, body.joints[joints_[2]].y() - ground, 0);
    ball_ = Vector3d(0, 0, body.joints[joints_[3]].z() - body.joints[joints_[2]].z());
  }

  double phase(double time) const { return start_ + time / cycle_; }

  /// Turns hip, knee, ankle and toes so that the foot is where the gait wants it. `root` maps the resting
  /// pelvis.
  void solve(double time, const Eigen::Isometry3d& root, Pose& pose) const {
    const double pitch = at_phase(kFootPitch, phase(time)) * kDegree;
    const Eigen::Isometry3d foot = foot_on_ground(time);
    const Vector3d pivot = pitch > 0 ? ball_ : -0.3 * ball_;  // rolls over the ball or over the heel
    const Matrix3d pitched = Eigen::AngleAxisd(pitch, Vector3d::UnitX()).toRotationMatrix();
    const Vector3d target = foot * (pivot + pitched * (ankle_ - pivot));

    const Vector3d &hip = body_.joints[joints_[0]], &knee = body_.joints[joints_[1]],
                   &ankle = body_.joints[joints_[2]];
    const Vector3d from = root * hip;
    const Vector3d lateral = root.rotation().col(0);
    const double thigh = (knee - hip).norm(), shank = (ankle - knee).norm();
    const double distance = std::min((target - from).norm(), 0.9995 * (thigh + shank));
    const Vector3d towards = (target - from).normalized();
    const Vector3d forward = lateral.cross(towards).normalized() * -1.0;
    const double cosine = (thigh * thigh + distance * distance - shank * shank) / (2 * thigh * distance);
    const Vector3d bend =
        from + thigh * (cosine * towards + std::sqrt(std::max(0.0, 1 - cosine * cosine)) * forward);

    const Matrix3d thigh_turn =
        bone_frame(bend - from, lateral) * bone_frame(knee - hip, Vector3d::UnitX()).transpose();
    const Matrix3d shank_turn = bone_frame(from + distance * towards - bend, lateral) *
                                bone_frame(ankle - knee, Vector3d::UnitX()).transpose();
    const Matrix3d foot_turn = foot.rotation() * pitched;
    pose[joints_[0]] = axis_angle_from_rotation(root.rotation().transpose() * thigh_turn);
    pose[joints_[1]] = axis_angle_from_rotation(thigh_turn.transpose() * shank_turn);
    pose[joints_[2]] = axis_angle_from_rotation(shank_turn.transpose() * foot_turn);
    pose[joints_[3]] = Vector3d(-std::max(0.0, pitch), 0, 0);  // toes stay on the ground
  }

 private:
  /// The flat foot's frame: its origin on the ground below the ankle.
  Eigen::Isometry3d foot_on_ground(double time) const {
    const double now = phase(time), landing = std::floor(now);
    const double swing = std::max(0.0, (now - landing - kStance) / (1 - kStance));
    const double moved = swing * swing * (3 - 2 * swing);
    const auto footprint = [&](double step, Vector3d& place) {
      const double middle = (step + 0.5 * kStance - start_) * cycle_;  // when the pelvis is above the foot
      const double yaw = path_.heading(middle);
      place = path_.position(middle) + side_ * kFootSpread * Vector3d(std::cos(yaw), 0, -std::sin(yaw));
      return yaw;
    };
    Vector3d before, after;
    const double yaw_before = footprint(landing, before), yaw_after = footprint(landing + 1, after);
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    frame.rotate(Eigen::AngleAxisd(std::lerp(yaw_before, yaw_after, moved), Vector3d::UnitY()));
    frame.translation() = before + moved * (after - before);
    frame.translation().y() = kLift * std::sin(std::numbers::pi * std::pow(swing, 0.6));
    return frame;
  }

  /// Axes of a bone: -y along it, x as near `lateral` as can be.
  static Matrix3d bone_frame(const Vector3d& bone, const Vector3d& lateral) {
    Matrix3d frame;
    frame.col(1) = -bone.normalized();
    frame.col(2) = lateral.cross(frame.col(1)).normalized();
    frame.col(0) = frame.col(1).cross(frame.col(2));
    return frame;
  }

  const Body& body_;
  const Path& path_;
  double side_;
  std::string name_;
  double cycle_, start_;
  std::vector<int> joints_;
  Vector3d ankle_, ball_;  ///< in the flat foot's frame
};

/// Pelvis, trunk and arms; `cycle` is the left leg's phase as an angle.
Pose upper_body(const Body& body, double cycle, double heading) {
  PoseBuilder builder(body);
  builder.set("Hips", 1, heading / kDegree - 5 * std::cos(cycle), 2 * std::sin(cycle));
  builder.set("LowerBack", 2, 3 * std::cos(cycle), -1.5 * std::sin(cycle));
  builder.set("Spine1", 1, 7 * std::cos(cycle), -std::sin(cycle));
  builder.set("Neck", 0, -3 * std::cos(cycle), 0).set("Head", -2, -2 * std::cos(cycle), 0);
  for (const bool left : {true, false}) {
    const double side = left ? 1 : -1, swing = -side * std::cos(cycle);  // an arm goes with the other leg
    const std::string name = left ? "Left" : "Right";
    builder.set(name + "Arm", -22 * swing + 4, 0, side * -31);
    builder.set(name + "ForeArm", 16 - 13 * swing, side * 12, 0);
  }
  return builder.pose();
}

/// Adds a frame: the pose above the origin, its lowest vertex on the floor.
void add_standing(Motion& motion, const Body& body, const Pose& pose) {
  const double lowest = lowest_height(posed_vertices(body, pose, Vector3d::Zero()));
  motion.pose.push_back(pose);
  motion.translation.push_back(Vector3d(-body.joints.front().x(), -lowest, -body.joints.front().z()));
}

}  // namespace

Motion procedural_walk(const Body& body, const WalkOptions& options) {
  const Path path(options);
  const Leg left(body, path, options, true), right(body, path, options, false);
  double ground = body.vertices.front().y();
  for (const Vector3d& vertex : body.vertices) ground = std::min(ground, vertex.y());
  Motion motion;
  motion.fps = options.fps;
  motion.joint_names = body.joint_names;
  Eigen::AlignedBox3d covered;
  for (int frame = 0; frame < options.frames; ++frame) {
    const double time = frame / options.fps, heading = path.heading(time);
    const double cycle = 2 * std::numbers::pi * left.phase(time);
    Pose pose = upper_body(body, cycle, heading);
    // The pelvis is lowest when both feet stand, and sways over the foot that stands alone.
    const double sway = 0.018 * std::cos(cycle - 2 * std::numbers::pi * 0.5 * kStance);
    Vector3d pelvis = path.position(time) + sway * Vector3d(std::cos(heading), 0, -std::sin(heading));
    pelvis.y() = body.joints.front().y() - ground - 0.043 - 0.014 * std::cos(2 * cycle);
    Eigen::Isometry3d root = Eigen::Isometry3d::Identity();
    root.linear() = rotation_from_axis_angle(pose[0]);
    root.translation() = pelvis - root.linear() * body.joints.front();
    left.solve(time, root, pose);
    right.solve(time, root, pose);
    motion.pose.push_back(pose);
    motion.translation.push_back(pelvis - body.joints.front());
    covered.extend(Vector3d(pelvis.x(), 0, pelvis.z()));
  }
  for (Vector3d& translation : motion.translation) translation -= covered.center();
  return motion;
}

Motion posture_collection(const Body& body) {
  std::vector<Pose> poses;
  const auto posture = [&](double heading) {
    return PoseBuilder(body).set("Hips", 0, heading, 0).both("Arm", 0, 0, -30).both("ForeArm", 12, 0, 0);
  };
  poses.push_back(posture(-15).both("Arm", -20, 0, 95).both("UpLeg", 0, 0, 8).pose());  // both arms raised
  poses.push_back(posture(20)
                      .both("Arm", 0, 0, 40)
                      .both("ForeArm", 25, 0, 20)
                      .both("UpLeg", 0, 0, 20)
                      .both("Foot", 0, 0, -20)
                      .pose());  // star
  poses.push_back(posture(0)
                      .set("RightArm", -15, 0, -80)
                      .set("RightForeArm", -30, 0, 40)
                      .set("Head", 0, -15, 6)
                      .pose());  // waving
  poses.push_back(posture(35)
                      .set("LeftUpLeg", -62, 0, -4)
                      .set("LeftLeg", 70, 0, 0)
                      .set("RightUpLeg", 22, 0, 2)
                      .set("RightLeg", 18, 0, 0)
                      .set("RightFoot", -25, 0, 0)
                      .set("LeftFoot", -8, 0, 0)
                      .both("Arm", -35, 0, -25)
                      .pose());  // lunge
  poses.push_back(posture(-30)
                      .both("UpLeg", -58, 10, 8)
                      .both("Leg", 82, 0, 0)
                      .both("Foot", -24, 0, 0)
                      .set("LowerBack", 24, 0, 0)
                      .both("Arm", -70, 0, -25)
                      .pose());  // squat
  poses.push_back(posture(10)
                      .set("Spine", 0, 28, 0)
                      .set("LowerBack", 6, 18, -8)
                      .set("LeftArm", -60, 0, -20)
                      .set("RightArm", 30, 0, -15)
                      .pose());  // twist
  poses.push_back(posture(-40)
                      .set("LeftUpLeg", -80, 0, -2)
                      .set("LeftLeg", 85, 0, 0)
                      .set("RightArm", -80, 0, -30)
                      .set("LeftArm", 25, 0, -30)
                      .pose());  // knee raised
  poses.push_back(posture(45)
                      .both("Arm", 8, 0, 5)
                      .both("ForeArm", -50, 0, -45)
                      .both("UpLeg", 0, 0, 5)
                      .set("Head", 5, 20, 0)
                      .pose());  // arms bent

  Motion motion;
  motion.fps = 1;
  motion.joint_names = body.joint_names;
  for (const Pose& pose : poses) add_standing(motion, body, pose);
  return motion;
}

Motion procedural_dance(const Body& body, double fps, int frames_each) {
  Motion postures = posture_collection(body);
  postures.pose.push_back(postures.pose.front());
  postures.translation.push_back(postures.translation.front());
  constexpr int fine = 64;  // in-between poses a posture, from which the eased ones are taken
  const Motion between = resampled(postures, fine * postures.fps);
  Motion motion;
  motion.fps = fps;
  motion.joint_names = body.joint_names;
  for (int posture = 0; posture + 1 < postures.frame_count(); ++posture)
    for (int i = 0; i < frames_each; ++i) {
      const double t = static_cast<double>(i) / frames_each, eased = t * t * (3 - 2 * t);
      add_standing(motion, body, between.pose[fine * posture + static_cast<int>(std::lround(fine * eased))]);
    }
  return motion;
}

}  // namespace vivant
