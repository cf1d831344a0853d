#pragma once
#include <map>
#include <string>

#include "vivant/data/body.hpp"
#include "vivant/data/motion.hpp"
#include "vivant/io/bvh.hpp"

namespace vivant {

/// Body joint to the joint of a motion file.
using JointMapping = std::map<std::string, std::string>;

/// Reads a mapping from a JSON object of strings: {"LeftUpLeg": "thigh_l", ...}.
JointMapping read_joint_mapping(const std::filesystem::path& path);

/// The motion of another skeleton on `body`. A body joint follows the source joint that `mapping` gives, else
/// the one of the same name, else its partner in the table of CMU and SMPL names; without one it stays at
/// rest. With Q the global rotation of the source joint, the body joint's is G = Q A: A turns the body's rest
/// bone onto the source's rest bone by the smallest angle for arms, legs and feet, is the parent's A for what
/// hangs on them, and the identity for the trunk. Lengths are scaled by the ratio of the legs, the first
/// frame's root stands at x = z = 0 and the ground at y = 0. Throws Error naming `source` and the joint when
/// the root or a limb has no partner.
Motion retargeted(const SkeletonMotion& motion, const Body& body, const JointMapping& mapping,
                  const std::string& source);

}  // namespace vivant
