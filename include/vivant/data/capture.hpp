#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vivant/data/body.hpp"
#include "vivant/data/camera.hpp"
#include "vivant/data/motion.hpp"
#include "vivant/io/ply.hpp"

namespace vivant {

/// An axis-aligned box in the world.
struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();
  Eigen::Vector3d size() const { return max - min; }
  Eigen::Vector3d centre() const { return 0.5 * (min + max); }
};

/// x, y, z, as ops take them.
inline std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// How a picture was exposed: its colours (0..1) are gain * colour + offset of what all pictures share.
struct Exposure {
  Eigen::Array3d gain = Eigen::Array3d::Ones(), offset = Eigen::Array3d::Zero();
  /// Shared colours, RGB after RGB, as this exposure shows them.
  void apply(std::span<float> colours) const;
  /// A picture (CV_8UC3, RGB) in the shared colours; they end at white, as the picture does.
  cv::Mat removed(const cv::Mat& taken) const;
};

/// One picture of a capture. Pictures are read when asked for.
struct CaptureFrame {
  std::string name;       ///< as the capture's file writes it: "images/0001.png"
  std::string mask_name;  ///< the same for the mask, empty when the frame has none
  std::filesystem::path image_path;
  std::filesystem::path mask_path;
  bool mask_keeps = false;  ///< nerfstudio's mask_path: 0 marks the pixels to leave out
  Camera camera;
  Exposure exposure;
  int body_frame = -1;    ///< row of the human's poses, -1 when there is none
  bool held_out = false;  ///< kept for evaluation
};

/// The person of a capture.
struct CaptureHuman {
  Body body;           ///< as the file holds it; shaped(body, poses.shape) is the person's own
  Motion poses;        ///< in the world of the cameras, metres
  bool exact = false;  ///< the poses are true, as of motion capture, and not fitted to the pictures
};

/// A video or a set of photographs with cameras, and a person when `human` is set. docs/capture-format.md.
struct Capture {
  std::filesystem::path source;  ///< the transforms.json
  double fps = 24;
  std::vector<CaptureFrame> frames;
  std::optional<CaptureHuman> human;
  PointCloud points;  ///< sparse points of the scene, may be empty
  Box scene_box;
  bool scene_box_given = false;  ///< false: derived from cameras, points or the body's path

  /// Indices of all frames, of those for training and of those for evaluation.
  std::vector<int> all_frames() const;
  std::vector<int> training_frames() const;
  std::vector<int> held_out_frames() const;
  /// Where a frame stands in what is learned for each training frame: its own row, or a held-out frame's
  /// share of up to four rows around it: a Catmull-Rom spline's over the frames, which are in order of time.
  /// Before the first and after the last training frame: that row.
  std::vector<std::pair<int, double>> training_rows(int frame) const;
  /// The picture of a frame as it was taken: CV_8UC3, RGB, of the camera's size. Throws Error when it cannot
  /// be read.
  cv::Mat taken_image(int frame) const;
  /// The same in the colours that all frames share: without its exposure.
  cv::Mat image(int frame) const;
  /// The mask of a frame: CV_8UC1, 255 = person (or left out of the scene); all zero when the frame has no
  /// mask.
  cv::Mat mask(int frame) const;
  /// The same as the file has it, with the grey values of a border that was drawn softly.
  cv::Mat soft_mask(int frame) const;
};

/// When load_capture looks at the pictures: at once, so that a bad one stops the program before hours of
/// work, or when each is read (a run whose pictures may have gone).
enum class PictureCheck { now, when_read };

/// Loads and checks a capture: a folder with a transforms.json, or the JSON file itself. Every failure is one
/// line.
Capture load_capture(const std::filesystem::path& path, PictureCheck check = PictureCheck::now);

/// Whether all cameras share one centre, so that the scene's depth cannot be seen: their spread is below 0.1
/// % of the distance to the scene (its sparse points, else the person; 1e-6 when there is neither).
bool camera_only_rotates(const Capture& capture);

/// The direction of "up" in the world: +y with a person, else the mean of the pictures' upward directions.
Eigen::Vector3d up_direction(const Capture& capture);

/// What the cameras look at: the middle of the person's path, else the point nearest to all optical axes.
Eigen::Vector3d focus_point(const Capture& capture);

/// The scene box of a capture that gives none: the middle 95 % of the sparse points and the cameras, else the
/// body's path plus 1 m on each side; throws Error when there is neither.
Box derived_scene_box(const Capture& capture);

/// Writes transforms.json, body.safetensors, poses.safetensors and points.ply (where there are any) to
/// `folder`. Pictures are not written: frames keep the names that they have. The scene box is written when it
/// was given.
void write_capture(const Capture& capture, const std::filesystem::path& folder);

/// Writes into `run_folder`/capture what rendering needs (cameras, body, poses, points, scene box), so that
/// the run can be moved; pictures are named by their absolute paths. load_capture(run_folder / "capture",
/// PictureCheck::when_read) reads it.
void copy_capture_essentials(const Capture& capture, const std::filesystem::path& run_folder);

}  // namespace vivant
