#include "vivant/model/camera_refinement.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include "graph_helpers.hpp"
#include "small_capture.hpp"
#include "vivant/jobs/capture_model.hpp"
#include "vivant/jobs/scene_trainer.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

constexpr const char* corrections = "scene.camera_corrections";
constexpr double unit = 2.5;

/// Different numbers for every frame, of the size of a few degrees.
std::vector<float> some_corrections(std::size_t frames) {
  std::vector<float> numbers(6 * frames);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = 0.05f * std::sin(1.7f * static_cast<float>(i + 1));
  return numbers;
}

std::vector<Vector3d> joints_in_picture(const Capture& capture, int frame) {
  const Body body = shaped(capture.human->body, capture.human->poses.shape);
  const int row = capture.frames[frame].body_frame;
  std::vector<Vector3d> joints = posed_joints(
      body, joint_transforms(body, capture.human->poses.pose[row], capture.human->poses.translation[row]));
  for (Vector3d& joint : joints) joint = capture.frames[frame].camera.project(joint);
  return joints;
}

}  // namespace

TEST_CASE("camera refinement: rays of the device are those of the corrected capture") {
  Device& device = test_device();
  const Capture& capture = small_capture();
  const std::vector<int> frames = capture.training_frames();
  ParameterStore store;
  const CameraRefinement cameras(store, static_cast<int>(frames.size()), unit);
  store.allocate(device);
  store.write(corrections, some_corrections(frames.size()));
  const Capture corrected = cameras.corrected(capture);

  const DeviceCapture data(device, capture, frames);
  const int width = data.width(), height = data.height();
  std::vector<std::int32_t> pixels;
  for (std::size_t row = 0; row < frames.size(); ++row)
    pixels.push_back(static_cast<std::int32_t>((row * height + 5 * row) * width + 7 * row));
  Graph graph;
  const Value ids =
      graph.constant({static_cast<std::int64_t>(pixels.size())}, std::span<const std::int32_t>(pixels));
  const Rays rays = cameras.corrected(graph, ray_generation(data.cameras(graph), ids, width, height), ids,
                                      static_cast<std::int64_t>(width) * height);
  Run run(graph, {rays.origins, rays.directions});
  const std::vector<float> origins = run.read(rays.origins), directions = run.read(rays.directions);
  for (std::size_t row = 0; row < frames.size(); ++row) {
    const Ray ray = corrected.frames[frames[row]].camera.ray({7.0 * row + 0.5, 5.0 * row + 0.5});
    const Vector3d o(origins[3 * row], origins[3 * row + 1], origins[3 * row + 2]),
        d(directions[3 * row], directions[3 * row + 1], directions[3 * row + 2]);
    CHECK((o - ray.origin).norm() < 1e-5);
    CHECK((d - ray.direction).norm() < 1e-5);
    CHECK((o - capture.frames[frames[row]].camera.centre()).norm() > 0.01);
  }
}

TEST_CASE("camera refinement: held-out cameras move as their neighbours, and the person with the camera") {
  Device& device = test_device();
  const Capture& capture = small_capture();
  const int rows = static_cast<int>(capture.training_frames().size());
  ParameterStore store;
  const CameraRefinement cameras(store, rows, unit);
  store.allocate(device);
  std::vector<float> same(6 * static_cast<std::size_t>(rows), 0.0f);
  for (int row = 0; row < rows; ++row) same[6 * row + 4] = 0.1f;  // all of them up
  store.write(corrections, same);
  const Capture lifted = cameras.corrected(capture);
  for (std::size_t i = 0; i < capture.frames.size(); ++i)
    CHECK((lifted.frames[i].camera.centre() - capture.frames[i].camera.centre() - Vector3d(0, 0.1 * unit, 0))
              .norm() < 1e-6);
  store.write(corrections, some_corrections(static_cast<std::size_t>(rows)));
  const Capture corrected = cameras.corrected(capture);
  for (int frame = 0; frame < static_cast<int>(capture.frames.size()); ++frame) {
    const std::vector<Vector3d> before = joints_in_picture(capture, frame),
                                after = joints_in_picture(corrected, frame);
    for (std::size_t joint = 0; joint < before.size(); ++joint)
      CHECK((before[joint] - after[joint]).norm() < 1e-6);
  }
}

TEST_CASE("exposure: what is applied is removed, held-out frames stand between their neighbours") {
  Device& device = test_device();
  const Capture& capture = small_capture();
  const int rows = static_cast<int>(capture.training_frames().size());
  ParameterStore store;
  const ExposureCorrection exposures(store, rows);
  store.allocate(device);
  std::vector<float> offsets(3 * static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row) offsets[3 * row + 1] = 0.01f * static_cast<float>(row);
  store.write("scene.exposure_offsets", offsets);
  const Capture corrected = exposures.corrected(capture);
  for (int frame = 0; frame < static_cast<int>(capture.frames.size()); ++frame) {
    double row = 0;
    for (const auto& [index, share] : capture.training_rows(frame)) row += index * share;
    CHECK(corrected.frames[frame].exposure.offset[1] == doctest::Approx(0.01 * row));
    CHECK(corrected.frames[frame].exposure.gain[1] == 1);
  }
  const Exposure bright{{1.25, 1, 1}, {0, 0.1, 0}};
  std::vector<float> colours = {0.4f, 0.4f, 0.4f, 0.9f, 0, 0};
  bright.apply(colours);
  CHECK(colours[0] == doctest::Approx(0.5));
  CHECK(colours[1] == doctest::Approx(0.5));
  CHECK(colours[3] == doctest::Approx(1.125));  // not clipped
  const cv::Mat taken(2, 2, CV_8UC3, cv::Scalar(125, 126, 100));
  CHECK(bright.removed(taken).at<cv::Vec3b>(1, 1) == cv::Vec3b(100, 100, 100));
}

TEST_CASE("corrections: a camera that was turned and a frame that was exposed less are found") {
  Device& device = test_device();
  Capture capture = small_capture();
  const std::vector<int> frames = capture.training_frames();
  const std::size_t turned = 3, darker = 5;
  const Vector3d turn(0.012, -0.016, 0);  // 1.4 pixels
  Camera& camera = capture.frames[frames[turned]].camera;
  const Vector3d centre = camera.centre();
  const Eigen::Isometry3d away = Eigen::Translation3d(centre) *
                                 Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
                                 Eigen::Translation3d(-centre);
  camera.world_to_camera = camera.world_to_camera * away.inverse().matrix();
  capture.frames[frames[darker]].exposure.gain.setConstant(
      1.25);  // image() takes it out again: 0.8 of the light

  const Config config =
      load_config("demo", std::nullopt,
                  {"scene.steps=400", "scene.rays=1024", "scene.plane_size=64", "scene.cameras=refined",
                   "scene.camera_rate=0.001", "scene.exposure_rate=0.005", "scene.camera_weight=1"});
  CaptureModel model(device, config, capture);
  const DeviceCapture data(device, capture, frames);
  SceneTrainer trainer(device, config, capture, data, model);
  for (std::int64_t step = 0; step < config.scene.steps; ++step) trainer.run(step);
  REQUIRE_FALSE(trainer.failure());
  const Capture found = model.corrected(capture);
  const auto rotation = [&](std::size_t row) {
    const Eigen::Matrix3d before = capture.frames[frames[row]].camera.world_to_camera.topLeftCorner<3, 3>(),
                          after = found.frames[frames[row]].camera.world_to_camera.topLeftCorner<3, 3>();
    return axis_angle_from_rotation(after.transpose() * before);
  };
  // Against the others: where the world itself stands and how bright it is, no picture shows.
  Vector3d others = Vector3d::Zero();
  double other_grey = 0;
  const auto grey = [&](std::size_t row) {  // what becomes of the middle of the colours
    const Exposure& exposure = found.frames[frames[row]].exposure;
    return (0.5 * exposure.gain + exposure.offset).mean();
  };
  for (std::size_t row = 0; row < frames.size(); ++row) {
    if (row != turned) others += rotation(row) / static_cast<double>(frames.size() - 1);
    if (row != darker) other_grey += grey(row) / static_cast<double>(frames.size() - 1);
  }
  const double left = (rotation(turned) - others + turn).norm(), gain = grey(darker) / 1.25 / other_grey;
  MESSAGE("turned by ", turn.norm(), ": ", left, " are left; exposed 0.8 times: found ", gain);
  CHECK(left < 0.4 * turn.norm());
  CHECK(std::abs(gain - 0.8) < 0.1);
}

TEST_CASE(
    "corrections: poses are corrected unless the capture says that they are exact, or as is asked for") {
  struct Case {
    const char* setting;
    bool exact, learned;
  };
  for (const Case& one :
       {Case{"auto", false, true}, {"auto", true, false}, {"learned", true, true}, {"none", false, false}}) {
    CAPTURE(one.setting);
    CAPTURE(one.exact);
    Capture capture = small_capture();
    capture.human->exact = one.exact;
    const Config config =
        load_config("demo", std::nullopt, {fmt::format("human.corrections={}", one.setting)});
    const CaptureModel model(test_device(), config, capture);
    const HumanOptions& options = model.human()->options();
    CHECK(options.bone_corrections == one.learned);
    CHECK(options.error_correction == one.learned);
  }
  CHECK(small_capture().human->exact);  // vivant synth says so of what it makes
}

TEST_CASE("capture model: the stylizer's attention is that of the settings, by default the shipped one's") {
  const auto options_of = [](const std::vector<std::string>& settings) {
    return CaptureModel(test_device(), load_config("demo", std::nullopt, settings), small_capture())
        .stylizer()
        .options();
  };
  const StylizerOptions shipped, usual = options_of({}),
                                 own = options_of({"style.feature_weight=0.7", "style.luma_weight=3"}),
                                 cosine = options_of({"style.attention=cosine", "style.luma_weight=3"});
  CHECK(usual.feature_weight == shipped.feature_weight);
  CHECK(usual.luma_weight == shipped.luma_weight);
  CHECK(own.feature_weight == 0.7);
  CHECK(own.luma_weight == 3);
  CHECK(cosine.cosine);
  CHECK(cosine.luma_weight == 0);
}
