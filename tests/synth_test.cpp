#include "vivant/jobs/synth.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/imgproc.hpp>

#include "io_helpers.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

using namespace vivant;
using Eigen::Vector3d;
using Eigen::Vector3i;
namespace fs = std::filesystem;

namespace {

SynthOptions small_capture(const fs::path& folder, std::uint32_t seed) {
  SynthOptions options;
  options.output = folder;
  options.frames = 10;
  options.width = 128;
  options.height = 96;
  options.seed = seed;
  return options;
}

/// Made once, read by several tests.
const fs::path& shared_capture() {
  static const TemporaryFolder folder;
  static const bool made = (synthesise(small_capture(folder.path(), 0)), true);
  static_cast<void>(made);
  return folder.path();
}

std::vector<Capture> all_captures() {
  const fs::path& folder = shared_capture();
  return {load_capture(folder), load_capture(folder / "truth" / "novel_views"),
          load_capture(folder / "truth" / "novel_poses")};
}

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = read_whole_file(entry.path());
  }
  return files;
}

std::vector<RigidTransform> transforms_of(const Capture& capture, const CaptureFrame& frame) {
  const CaptureHuman& human = *capture.human;
  return joint_transforms(human.body, human.poses.pose[frame.body_frame],
                          human.poses.translation[frame.body_frame]);
}

/// The person's silhouette drawn by another rasteriser.
cv::Mat silhouette(const Capture& capture, const CaptureFrame& frame) {
  const int fine = 8;
  cv::Mat large(frame.camera.height * fine, frame.camera.width * fine, CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> projected;
  for (const Vector3d& vertex : skin(capture.human->body, transforms_of(capture, frame))) {
    const Vector3d p = frame.camera.project(vertex);
    projected.emplace_back(static_cast<int>(std::floor(p.x() * fine)),
                           static_cast<int>(std::floor(p.y() * fine)));
  }
  for (const Vector3i& t : capture.human->body.triangles) {
    cv::fillConvexPoly(large, std::vector<cv::Point>{projected[t[0]], projected[t[1]], projected[t[2]]}, 255);
  }
  cv::Mat small;
  cv::resize(large, small, {frame.camera.width, frame.camera.height}, 0, 0, cv::INTER_AREA);
  return small >= 128;
}

}  // namespace

TEST_CASE("synth: the same seed gives the same bytes, another seed does not") {
  const auto first = files_in(shared_capture());
  const TemporaryFolder again, changed;
  synthesise(small_capture(again.path(), 0));
  synthesise(small_capture(changed.path(), 1));
  const auto second = files_in(again.path());
  CHECK(first.size() > 3 * 10);
  CHECK(first == second);
  CHECK(load_poses(shared_capture() / "dance.safetensors").frame_count() == 64);
  const auto other = files_in(changed.path());
  CHECK(first.at("images/0001.png") != other.at("images/0001.png"));
  CHECK(first.at("poses.safetensors") != other.at("poses.safetensors"));
}

TEST_CASE("synth: masks are the silhouette of the posed body") {
  for (const Capture& capture : all_captures()) {
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
      const cv::Mat mask = capture.mask(static_cast<int>(i));
      const cv::Mat expected = silhouette(capture, capture.frames[i]);
      CHECK(cv::countNonZero(mask) > 300);
      CHECK(cv::countNonZero(mask == 255) + cv::countNonZero(mask == 0) == static_cast<int>(mask.total()));
      const double overlap = cv::countNonZero(mask & expected), united = cv::countNonZero(mask | expected);
      CHECK(overlap / united > 0.93);
    }
  }
}

TEST_CASE("synth: every camera sees all of the person's joints, and the scene's points lie in the box") {
  for (const Capture& capture : all_captures()) {
    REQUIRE(capture.human.has_value());
    CHECK(capture.scene_box_given);
    CHECK_FALSE(camera_only_rotates(capture));
    for (const CaptureFrame& frame : capture.frames) {
      for (const Vector3d& joint : posed_joints(capture.human->body, transforms_of(capture, frame))) {
        const Vector3d seen = frame.camera.project(joint);
        CHECK(seen.z() > 1);
        CHECK((seen.x() > 0 && seen.x() < frame.camera.width));
        CHECK((seen.y() > 0 && seen.y() < frame.camera.height));
      }
    }
  }
  const Capture capture = load_capture(shared_capture());
  CHECK(capture.points.positions.size() >= 1000);
  for (const Eigen::Vector3f& point : capture.points.positions) {
    CHECK(((point.cast<double>() - capture.scene_box.min).minCoeff() > -1e-4 &&
           (capture.scene_box.max - point.cast<double>()).minCoeff() > -1e-4));
  }
}

TEST_CASE("synth: points have the colours of the pictures in which they are seen") {
  const Capture capture = load_capture(shared_capture());
  const cv::Mat image = capture.image(0), mask = capture.mask(0);
  const Camera& camera = capture.frames[0].camera;
  double error = 0, spread = 0;
  int count = 0;
  for (std::size_t i = 0; i < 120;
       ++i) {  // the first camera's own points, so nothing but the person hides them
    const Vector3d seen = camera.project(capture.points.positions[i].cast<double>());
    const cv::Point pixel(static_cast<int>(seen.x()), static_cast<int>(seen.y()));
    REQUIRE(pixel.inside(cv::Rect(0, 0, image.cols, image.rows)));
    if (mask.at<std::uint8_t>(pixel) != 0) continue;
    error += std::abs(capture.points.colours[i][1] - image.at<cv::Vec3b>(pixel)[1]);
    spread += std::abs(capture.points.colours[i][1] - cv::mean(image)[1]);
    ++count;
  }
  CHECK(count > 60);
  CHECK(error < 0.6 * spread);  // textures are finer than these small pixels, and points know no shadows
}

TEST_CASE("synth: every eighth frame is held out; the truth holds other views and other poses") {
  const std::vector<Capture> captures = all_captures();
  CHECK(captures[0].held_out_frames() == std::vector<int>{0, 8});
  const std::vector<CaptureFrame>& training = captures[0].frames;
  for (const CaptureFrame& frame : captures[1].frames) {
    REQUIRE(frame.body_frame < static_cast<int>(training.size()));
    for (const CaptureFrame& other : training) {
      CHECK((frame.camera.centre() - other.camera.centre()).norm() > 0.1);
    }
    const Vector3d as_filmed = training[frame.body_frame].camera.centre();
    CHECK((frame.camera.centre() - as_filmed).norm() > 0.2);
  }
  for (const Pose& posture : captures[2].human->poses.pose) {
    for (const Pose& filmed : captures[0].human->poses.pose) {
      double largest = 0;
      for (std::size_t j = 1; j < posture.size(); ++j) {  // joint 0 only turns the whole body
        const Eigen::AngleAxisd between(rotation_from_axis_angle(posture[j]).transpose() *
                                        rotation_from_axis_angle(filmed[j]));
        largest = std::max(largest, std::abs(between.angle()));
      }
      CHECK(largest > 0.5);
    }
  }
}

TEST_CASE("synth: options that make no sense are refused") {
  SynthOptions options = small_capture(shared_capture(), 0);
  CHECK_THROWS_WITH_AS(synthesise(options), doctest::Contains("not an empty folder"), Error);
  options.output /= "new";
  options.frames = 1;
  CHECK_THROWS_AS(synthesise(options), UsageError);
  options = small_capture(shared_capture() / "new", 0);
  options.width = 8;
  CHECK_THROWS_AS(synthesise(options), UsageError);
}
