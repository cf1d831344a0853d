#include "vivant/jobs/synth.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth_renderer.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/data/walk.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;
using Eigen::Vector3d;

namespace {

constexpr double kFramesPerSecond = 20;
constexpr int kPointsPerFrame = 120;
constexpr int kNovelViewEvery = 5;

/// A place for the camera, relative to what it looks at.
struct Viewpoint {
  double azimuth;  ///< degrees about +y: 0 stands on the +z side, 90 on the +x side
  double height;   ///< metres above the floor
  double distance;
};

/// Where the training camera is when a fraction `s` of the film has passed: a slow arc with a little sway.
Viewpoint along_arc(double s) {
  const double turn = 2 * std::numbers::pi * s;
  return {28 - 56 * s, 1.35 + 0.12 * std::sin(turn), 3.3 + 0.08 * std::cos(turn)};
}

/// At the same instant nearer to the arc's middle and higher: never on the path, and looking at what the path
/// has seen, for nobody can reconstruct the rest.
Viewpoint beside_arc(double s) {
  const Viewpoint view = along_arc(s);
  return {0.4 * view.azimuth + 6, view.height + 0.22, view.distance - 0.1};
}

Camera camera_at(const SynthOptions& options, const Viewpoint& view, const Vector3d& root) {
  Camera camera;
  camera.width = options.width;
  camera.height = options.height;
  // The person fills most of the height of a wide picture and most of the width of a narrow one.
  camera.fx = camera.fy = 1.5 * std::min<double>(options.height, options.width);
  camera.cx = 0.5 * options.width;
  camera.cy = 0.5 * options.height;
  const Vector3d centre(0.6 * root.x(), 0.92, 0.6 * root.z());
  const double azimuth = view.azimuth * std::numbers::pi / 180;
  const Vector3d eye(centre.x() + view.distance * std::sin(azimuth), view.height,
                     centre.z() + view.distance * std::cos(azimuth));
  camera.world_to_camera = look_at(eye, centre, Vector3d::UnitY());
  return camera;
}

void check(const SynthOptions& options) {
  const auto require = [](bool good, const char* message) {
    if (!good) throw UsageError(message);
  };
  require(options.frames >= 2 && options.frames <= 10000, "synth: --frames must be between 2 and 10000");
  require(options.width >= 32 && options.height >= 32 && options.width <= 4096 && options.height <= 4096,
          "synth: both sides of --size must be between 32 and 4096 pixels");
  std::error_code ignored;
  if (fs::exists(options.output, ignored) && !fs::is_empty(options.output, ignored)) {
    fail("synth: '{}' exists and is not an empty folder; choose another or remove it",
         options.output.string());
  }
}

/// Height over the floor apart, the root's place in the world at a frame.
Vector3d root_position(const Body& body, const Motion& motion, int frame) {
  return body.joints.front() + motion.translation[frame];
}

Motion motion_of(const SynthOptions& options, const Body& body, double free_half_width) {
  if (options.motion.empty()) {
    WalkOptions walk;
    walk.frames = options.frames;
    walk.fps = kFramesPerSecond;
    walk.start_phase = synth::lattice_random(9, 0, 0, options.seed);
    return procedural_walk(body, walk);
  }
  Motion motion = resampled(load_motion(options.motion, body), kFramesPerSecond);
  if (motion.frame_count() < options.frames) {
    fail("'{}' lasts {} frames at {} frames a second, {} are asked for; lower --frames",
         options.motion.string(), motion.frame_count(), kFramesPerSecond, options.frames);
  }
  motion.pose.resize(options.frames);
  motion.translation.resize(options.frames);
  motion = placed(body, motion, {});
  Eigen::AlignedBox3d path;
  for (int i = 0; i < motion.frame_count(); ++i) path.extend(root_position(body, motion, i));
  const Vector3d middle(path.center().x(), 0, path.center().z());
  for (Vector3d& translation : motion.translation) translation -= middle;
  const double reach = 0.5 * std::max(path.sizes().x(), path.sizes().z());
  if (reach > free_half_width) {
    fail("'{}' travels {:.1f} m, the room has {:.1f} m free; lower --frames", options.motion.string(),
         2 * reach, 2 * free_half_width);
  }
  return motion;
}

/// One picture to make: when and from where.
struct Shot {
  int body_frame;
  Camera camera;
};

/// Writes a capture of some shots and reports each picture.
class Film {
 public:
  Film(const SynthOptions& options, const SynthProgress& progress, int total)
      : body_(synth::dressed(load_body(asset_path("body.safetensors")))),
        room_(options.seed),
        wardrobe_(options.seed),
        renderer_(room_, body_, wardrobe_),
        progress_(progress),
        total_(total) {}

  const Body& body() const { return body_; }
  const synth::Room& room() const { return room_; }

  Capture shoot(const fs::path& folder, const Motion& motion, const std::vector<Shot>& shots) {
    Capture capture;
    capture.source = folder / "transforms.json";
    capture.fps = kFramesPerSecond;
    capture.human = CaptureHuman{.body = body_, .poses = motion, .exact = true};
    capture.scene_box = room_.box();
    capture.scene_box_given = true;
    make_folder(folder / "images");
    make_folder(folder / "masks");
    for (const Shot& shot : shots) {
      CaptureFrame frame;
      const std::string file = fmt::format("{:04}.png", capture.frames.size() + 1);
      frame.name = "images/" + file;
      frame.mask_name = "masks/" + file;
      frame.camera = shot.camera;
      frame.body_frame = shot.body_frame;
      const synth::Picture picture =
          renderer_.render(shot.camera, motion.pose[shot.body_frame], motion.translation[shot.body_frame]);
      write_image(folder / frame.name, picture.image);
      write_image(folder / frame.mask_name, picture.mask);
      capture.frames.push_back(std::move(frame));
      if (progress_) progress_(++done_, total_);
    }
    return capture;
  }

  /// Points where rays of the training cameras meet the room: what structure from motion would find, exactly.
  PointCloud surface_points(const std::vector<Shot>& shots, std::uint32_t seed) const {
    PointCloud cloud;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const Camera& camera = shots[i].camera;
      for (int k = 0; k < kPointsPerFrame; ++k) {
        const int shot = static_cast<int>(i);
        const Ray ray = camera.ray({camera.width * synth::lattice_random(shot, k, 0, seed),
                                    camera.height * synth::lattice_random(shot, k, 1, seed)});
        const synth::RoomHit hit = room_.intersect({ray.origin.cast<float>(), ray.direction.cast<float>()});
        const cv::Vec3b colour = synth::to_srgb(synth::flat_colour(room_, hit));
        cloud.positions.push_back(hit.position);
        cloud.colours.push_back({colour[0], colour[1], colour[2]});
      }
    }
    return cloud;
  }

 private:
  Body body_;
  synth::Room room_;
  synth::Wardrobe wardrobe_;
  synth::Renderer renderer_;
  const SynthProgress& progress_;
  int total_;
  int done_ = 0;
};

std::vector<Shot> training_shots(const SynthOptions& options, const Body& body, const Motion& motion) {
  std::vector<Shot> shots;
  for (int i = 0; i < options.frames; ++i) {
    const double s = static_cast<double>(i) / (options.frames - 1);
    shots.push_back({i, camera_at(options, along_arc(s), root_position(body, motion, i))});
  }
  return shots;
}

std::vector<Shot> novel_view_shots(const SynthOptions& options, const Body& body, const Motion& motion) {
  std::vector<Shot> shots;
  for (int i = kNovelViewEvery / 2; i < options.frames || shots.empty(); i += kNovelViewEvery) {
    const int frame = std::min(i, options.frames - 1);
    const double s = static_cast<double>(frame) / (options.frames - 1);
    shots.push_back({frame, camera_at(options, beside_arc(s), root_position(body, motion, frame))});
  }
  return shots;
}

/// The moment of the walk at which a posture is shown.
double moment_of(int posture, const Motion& postures) { return (posture + 0.5) / postures.frame_count(); }

/// The postures where the walker is at their moments, so that cameras of the walk see them and what is
/// behind.
Motion along_walk(Motion postures, const Body& body, const Motion& walk) {
  for (int i = 0; i < postures.frame_count(); ++i) {
    const int frame = static_cast<int>(std::lround(moment_of(i, postures) * (walk.frame_count() - 1)));
    Vector3d away = root_position(body, walk, frame) - root_position(body, postures, i);
    away.y() = 0;  // a lunge is lower
    postures.translation[i] += away;
  }
  return postures;
}

std::vector<Shot> novel_pose_shots(const SynthOptions& options, const Body& body, const Motion& postures) {
  std::vector<Shot> shots;
  shots.reserve(postures.frame_count());
  for (int i = 0; i < postures.frame_count(); ++i)
    shots.push_back(
        {i, camera_at(options, along_arc(moment_of(i, postures)), root_position(body, postures, i))});
  return shots;
}

}  // namespace

void synthesise(const SynthOptions& options, const SynthProgress& progress) {
  check(options);
  const int novel_views = (options.frames + kNovelViewEvery - 1 - kNovelViewEvery / 2) / kNovelViewEvery;
  Film film(options, progress, options.frames + std::max(1, novel_views) + 8);
  const Motion motion = motion_of(options, film.body(), film.room().free_half_width());
  const std::vector<Shot> shots = training_shots(options, film.body(), motion);
  Capture training = film.shoot(options.output, motion, shots);
  training.points = film.surface_points(shots, options.seed + 90);
  for (std::size_t i = 0; i < training.frames.size(); ++i) training.frames[i].held_out = i % 8 == 0;

  const fs::path truth = options.output / "truth";
  Capture views = film.shoot(truth / "novel_views", motion, novel_view_shots(options, film.body(), motion));
  write_capture(views, truth / "novel_views");
  const Motion postures = along_walk(posture_collection(film.body()), film.body(), motion);
  Capture poses =
      film.shoot(truth / "novel_poses", postures, novel_pose_shots(options, film.body(), postures));
  write_capture(poses, truth / "novel_poses");
  save_poses(options.output / "dance.safetensors", procedural_dance(film.body(), kFramesPerSecond));
  write_capture(training, options.output);  // last: a capture that can be loaded is whole
}

}  // namespace vivant
