#pragma once
#include "vivant/data/body.hpp"
#include "vivant/data/motion.hpp"

namespace vivant {

/// A walk along an arc of a circle. Headings are degrees about +y: 0 faces +z, 90 faces +x.
struct WalkOptions {
  int frames = 40;
  double fps = 20;
  double steps_per_second = 1.8;
  double start_heading = -45;
  double end_heading = 45;
  double start_phase =
      0;  ///< in [0,1): where in the gait cycle the left leg is at the first frame; 0 = its heel lands
};

/// A walk: footprints along the path, each foot rolling from heel to toe where it stands and swinging to the
/// next print, hips and knees solved from the feet, arms against the legs, a turning pelvis. The ground is y
/// = 0 and the middle of the path is above the origin. The body needs the joints of the CMU rig and faces +z
/// at rest; throws Error when a joint is missing.
Motion procedural_walk(const Body& body, const WalkOptions& options = {});

/// Eight still poses that no walk contains (raised arms, wide stance, lunge, ...), one a frame, standing on y
/// = 0 above the origin, facing about +z. Needs the joints of the CMU rig.
Motion posture_collection(const Body& body);

/// A dance through the postures and back to the first, `frames_each` frames from one to the next, slow at
/// both ends; the lowest foot stays on the floor.
Motion procedural_dance(const Body& body, double fps = 20, int frames_each = 8);

}  // namespace vivant
