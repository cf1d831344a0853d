#pragma once
#include <array>
#include <opencv2/core.hpp>
#include <span>

#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"

namespace vivant {

/// A part of the body that moves by itself: a joint with all below it, down to the joints of other limbs.
struct Limb {
  const char* name;
  std::array<const char*, 2> joints;  ///< its name in MakeHuman's CMU rig and in SMPL
};
/// The trunk, from the hips to the neck, is none of them.
inline constexpr std::array<Limb, 13> limbs = {{{"head", {"Head", "head"}},
                                                {"left upper arm", {"LeftArm", "left_shoulder"}},
                                                {"left forearm", {"LeftForeArm", "left_elbow"}},
                                                {"left hand", {"LeftHand", "left_wrist"}},
                                                {"left upper leg", {"LeftUpLeg", "left_hip"}},
                                                {"left lower leg", {"LeftLeg", "left_knee"}},
                                                {"left foot", {"LeftFoot", "left_ankle"}},
                                                {"right upper arm", {"RightArm", "right_shoulder"}},
                                                {"right forearm", {"RightForeArm", "right_elbow"}},
                                                {"right hand", {"RightHand", "right_wrist"}},
                                                {"right upper leg", {"RightUpLeg", "right_hip"}},
                                                {"right lower leg", {"RightLeg", "right_knee"}},
                                                {"right foot", {"RightFoot", "right_ankle"}}}};

/// What a camera sees of a posed body.
struct BodySilhouette {
  cv::Mat mask;  ///< CV_8UC1 [H, W], 255 where the body is at the pixel's centre
  cv::Mat limb;  ///< CV_32SC1 [H, W], index into `limbs` of what is nearest; -1: the trunk, or nothing
};

/// Draws the body's triangles. `vertices`: the posed ones [V], in the camera's world. A triangle belongs to
/// the limb of the joint that moves its first corner most.
BodySilhouette body_silhouette(const Body& body, std::span<const Eigen::Vector3d> vertices,
                               const Camera& camera);

/// Draws the body in a pose, in a world in which a metre is `units_per_metre`.
BodySilhouette posed_silhouette(const Body& body, const Pose& pose, const Eigen::Vector3d& translation,
                                const Camera& camera, double units_per_metre = 1);

}  // namespace vivant
