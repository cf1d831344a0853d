#include "vivant/data/capture.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "body_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/data/camera_path.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;
using Eigen::Vector3d;
using nlohmann::json;

namespace {

cv::Mat gradient(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<cv::Vec3b>(y, x) = cv::Vec3b(x * 7, y * 5, x + y);
  }
  return image;
}

/// Writes a small capture of ten frames with a person: 16x12 pictures, masks, poses, a body.
json write_example(const TemporaryFolder& folder) {
  std::filesystem::create_directories(folder / "images");
  std::filesystem::create_directories(folder / "masks");
  json whole = {{"fl_x", 20}, {"w", 16}, {"h", 12}, {"fps", 10}, {"frames", json::array()}};
  whole["human"] = {{"body", "body.safetensors"}, {"poses", "poses.safetensors"}};
  cv::Mat mask = cv::Mat::zeros(12, 16, CV_8UC1);
  cv::rectangle(mask, {4, 4}, {8, 10}, 255, cv::FILLED);
  Motion motion;
  for (int i = 0; i < 10; ++i) {
    write_image(folder / fmt::format("images/{}.png", i), gradient(16, 12));
    write_image(folder / fmt::format("masks/{}.png", i), mask);
    json matrix = {{1, 0, 0, 0.1 * i}, {0, 1, 0, 1}, {0, 0, 1, 6}, {0, 0, 0, 1}};
    whole["frames"].push_back({{"file_path", fmt::format("images/{}.png", i)},
                               {"human_mask_path", fmt::format("masks/{}.png", i)},
                               {"body_frame", i},
                               {"transform_matrix", matrix}});
    motion.pose.emplace_back(3, Vector3d(0.01 * i, 0, 0));
    motion.translation.emplace_back(0, 0, 0.1 * i);
  }
  save_body(folder / "body.safetensors", chain_body());
  save_poses(folder / "poses.safetensors", motion);
  return whole;
}

}  // namespace

TEST_CASE("capture: a small example loads with its person, masks and defaults") {
  const TemporaryFolder folder;
  write_file(folder / "transforms.json", write_example(folder).dump());
  const Capture capture = load_capture(folder.path());
  REQUIRE(capture.frames.size() == 10);
  CHECK(capture.fps == 10);
  CHECK(capture.held_out_frames() == std::vector<int>{0, 8});
  CHECK(capture.training_frames().size() == 8);
  const Camera& camera = capture.frames[3].camera;
  CHECK(camera.fy == 20);
  CHECK(camera.cx == 8);
  CHECK(camera.cy == 6);
  CHECK((camera.centre() - Vector3d(0.3, 1, 6)).norm() < 1e-12);
  REQUIRE(capture.human.has_value());
  CHECK_FALSE(capture.human->exact);
  CHECK(capture.frames[3].body_frame == 3);
  CHECK(cv::norm(capture.image(3), gradient(16, 12), cv::NORM_INF) == 0);
  CHECK(cv::countNonZero(capture.mask(3)) == 35);
  CHECK(capture.mask(3).at<std::uint8_t>(4, 4) == 255);
  // The box holds the joints' path and a metre around it.
  CHECK_FALSE(capture.scene_box_given);
  CHECK(capture.scene_box.min.y() == doctest::Approx(-1));
  CHECK(capture.scene_box.max.z() == doctest::Approx(0.9 + 2 * std::sin(0.18) + 1).epsilon(0.05));
  CHECK_FALSE(camera_only_rotates(capture));
  // The JSON file itself may be named, and pictures may be missing when they are not wanted yet.
  std::filesystem::remove_all(folder / "images");
  CHECK(load_capture(folder / "transforms.json", PictureCheck::when_read).frames.size() == 10);
}

TEST_CASE("capture: intrinsics of a frame, the angle form, scaled pictures and nerfstudio masks") {
  const TemporaryFolder folder;
  json whole = write_example(folder);
  whole.erase("fl_x");
  whole["camera_angle_x"] = 2 * std::atan(0.5);
  whole["frames"][1]["fl_x"] = 99;
  whole["w"] = 32;
  whole["h"] = 24;
  whole["frames"][2].erase("human_mask_path");
  whole["frames"][2]["mask_path"] = "masks/2.png";
  whole["frames"][4].erase("human_mask_path");
  whole["splits"] = {{"test", {"images/5.png"}}};
  whole["scene_box"] = {{-1, -2, -3}, {1, 2, 3}};
  write_file(folder / "transforms.json", whole.dump());
  const Capture capture = load_capture(folder.path());
  // Stated at 32x24, the pictures are 16x12: everything halves.
  CHECK(capture.frames[0].camera.width == 16);
  CHECK(capture.frames[0].camera.fx == doctest::Approx(16));
  CHECK(capture.frames[1].camera.fx == doctest::Approx(49.5));
  CHECK(capture.frames[0].camera.cx == doctest::Approx(8));
  CHECK(cv::countNonZero(capture.mask(2)) == 16 * 12 - 35);
  CHECK(cv::countNonZero(capture.mask(4)) == 0);
  CHECK(capture.held_out_frames() == std::vector<int>{5});
  CHECK(capture.scene_box.min == Vector3d(-1, -2, -3));
}

TEST_CASE("capture: soft masks keep the grey of their borders, and half of a pixel decides") {
  const TemporaryFolder folder;
  json whole = write_example(folder);
  cv::Mat soft = cv::Mat::zeros(12, 16, CV_8UC1), flags = soft.clone();
  soft.at<std::uint8_t>(4, 4) = 255;
  soft.at<std::uint8_t>(4, 5) = 128;
  soft.at<std::uint8_t>(4, 6) = 100;
  flags.at<std::uint8_t>(5, 5) = 1;
  for (int i : {1, 2}) write_image(folder / fmt::format("masks/{}.png", i), soft);
  write_image(folder / "masks/3.png", flags);
  whole["frames"][2].erase("human_mask_path");
  whole["frames"][2]["mask_path"] = "masks/2.png";
  write_file(folder / "transforms.json", whole.dump());
  const Capture capture = load_capture(folder.path());
  CHECK(cv::norm(capture.soft_mask(1), soft, cv::NORM_INF) == 0);
  CHECK(cv::countNonZero(capture.mask(1)) == 2);
  CHECK(capture.soft_mask(2).at<std::uint8_t>(4, 6) == 155);
  CHECK(cv::countNonZero(capture.mask(2)) == 16 * 12 - 2);
  CHECK(capture.soft_mask(3).at<std::uint8_t>(5, 5) == 255);
  CHECK(cv::countNonZero(capture.soft_mask(3)) == 1);
}

TEST_CASE("capture: every bad input gives one clear line") {
  const TemporaryFolder folder;
  const json good = write_example(folder);
  const auto error_after = [&](auto&& change) {
    json whole = good;
    change(whole);
    write_file(folder / "transforms.json", whole.dump());
    return error_of([&] { load_capture(folder.path()); });
  };
  const auto expect = [&](const char* message, auto&& change) {
    const std::string error = error_after(change);
    CAPTURE(error);
    CHECK(contains(error, message));
  };
  CHECK(error_after([](json&) {}).empty());
  expect("'frames' must be", [](json& j) { j.erase("frames"); });
  expect("'frames' must be", [](json& j) { j["frames"] = json::array(); });
  expect("frame 2: it must be an object", [](json& j) { j["frames"][2] = 3; });
  expect("frame 2: 'file_path' is missing", [](json& j) { j["frames"][2].erase("file_path"); });
  expect("none.png' does not exist", [](json& j) { j["frames"][2]["file_path"] = "images/none.png"; });
  expect("focal length", [](json& j) { j.erase("fl_x"); });
  expect("'fl_x' must be a number", [](json& j) { j["fl_x"] = "20"; });
  expect("'fl_x' is -3", [](json& j) { j["fl_x"] = -3; });
  expect("'camera_angle_x' is 4", [](json& j) { j.erase("fl_x"), j["camera_angle_x"] = 4; });
  expect("'w' is 16.5", [](json& j) { j["w"] = 16.5; });
  expect("must stand together", [](json& j) { j.erase("w"); });
  expect("another aspect ratio", [](json& j) { j["w"] = 20; });
  expect("'OPENCV_FISHEYE' is not supported", [](json& j) { j["camera_model"] = "OPENCV_FISHEYE"; });
  expect("'k3' is not supported", [](json& j) { j["k3"] = 0.1; });
  expect("4 rows of 4", [](json& j) { j["frames"][0]["transform_matrix"].erase(3); });
  expect("4 rows of 4", [](json& j) { j["frames"][0]["transform_matrix"][1][1] = nullptr; });
  expect("a rotation and a translation", [](json& j) { j["frames"][0]["transform_matrix"][1][1] = 2; });
  expect("a rotation and a translation", [](json& j) { j["frames"][0]["transform_matrix"][1][1] = -1; });
  expect("'body_frame' is 10", [](json& j) { j["frames"][9]["body_frame"] = 10; });
  expect("frame 7: no 'body_frame'", [](json& j) { j["frames"][7].erase("body_frame"); });
  expect("must have 'poses'", [](json& j) { j["human"].erase("poses"); });
  expect("'exact' must be true or false", [](json& j) { j["human"]["exact"] = 1; });
  expect("none.safetensors' does not exist", [](json& j) { j["human"]["body"] = "none.safetensors"; });
  expect("names 'images/77.png'", [](json& j) { j["splits"] = {{"test", {"images/77.png"}}}; });
  expect("'splits' must be", [](json& j) { j["splits"] = {{"train", json::array()}}; });
  expect("none is left for training", [](json& j) {
    j["frames"].erase(j["frames"].begin() + 1, j["frames"].end());
    j["splits"] = {{"test", {"images/0.png"}}};
  });
  expect("'scene_box' must be", [](json& j) { j["scene_box"] = {{0, 0, 0}, {1, 0, 1}}; });
  expect("'scene_box' must be", [](json& j) { j["scene_box"] = 4; });
  expect("no scene box can be derived", [](json& j) { j.erase("human"); });
  expect("none.ply' does not exist", [](json& j) { j["ply_file_path"] = "none.ply"; });
  expect("'fps' is 0", [](json& j) { j["fps"] = 0; });
  write_file(folder / "transforms.json", "{\n \"w\": 16,\n \"h\": ]\n}");
  CHECK(contains(error_of([&] { load_capture(folder.path()); }), "transforms.json: line 3: broken JSON"));
  CHECK(contains(error_of([&] { load_capture(folder / "none"); }), "none' does not exist"));
}

TEST_CASE("capture: bad pictures, masks and poses give one clear line") {
  const TemporaryFolder folder;
  write_file(folder / "transforms.json", write_example(folder).dump());
  const auto error = [&] { return error_of([&] { load_capture(folder.path()); }); };
  const std::string picture = read_whole_file(folder / "images/4.png");
  write_file(folder / "images/4.png", picture.substr(0, picture.size() / 2));
  CHECK(contains(error(), "images/4.png: the image is cut short"));
  write_file(folder / "images/4.png", picture);
  write_image(folder / "masks/5.png", cv::Mat::zeros(11, 16, CV_8UC1));
  CHECK(contains(error(), "masks/5.png: the mask is 16x11, its picture 16x12"));
  std::filesystem::remove(folder / "masks/5.png");
  CHECK(contains(error(), "masks/5.png' does not exist"));
  write_image(folder / "masks/5.png", cv::Mat::zeros(12, 16, CV_8UC1));
  CHECK(error().empty());

  TensorFile poses = read_safetensors(folder / "poses.safetensors");
  const float nan = NAN;
  std::memcpy(poses.tensors.at("pose").bytes.data() + 4 * (2 * 9 + 3), &nan, 4);
  write_safetensors(folder / "poses.safetensors", poses);
  CHECK(contains(error(), "poses.safetensors: the pose of frame 2, joint 1 is not finite"));
  const std::vector<float> four_joints(10 * 4 * 3);
  poses.tensors.at("pose") = HostTensor({10, 4, 3}, std::span<const float>(four_joints));
  write_safetensors(folder / "poses.safetensors", poses);
  CHECK(contains(error(), "poses.safetensors: frame 0 has 4 joints, the body has 3"));
}

TEST_CASE("capture: written and read again it is the same; a run can be moved") {
  const TemporaryFolder folder;
  json whole = write_example(folder);
  whole["k1"] = 0.05;
  whole["frames"][2]["fl_x"] = 21.5;
  whole["human"]["exact"] = true;
  whole["frames"][7].erase("human_mask_path");
  write_file(folder / "transforms.json", whole.dump());
  Capture capture = load_capture(folder.path());
  capture.points.positions = {{1, 2, 3}, {4, 5, 6}};
  capture.points.colours = {{1, 2, 3}, {4, 5, 6}};
  capture.scene_box = derived_scene_box(capture);
  std::filesystem::create_directories(folder / "run");
  copy_capture_essentials(capture, folder / "run");
  std::filesystem::rename(folder / "run", folder / "moved");
  const Capture copy = load_capture(folder / "moved/capture", PictureCheck::when_read);
  REQUIRE(copy.frames.size() == capture.frames.size());
  for (std::size_t i = 0; i < copy.frames.size(); ++i) {
    const Camera &a = capture.frames[i].camera, &b = copy.frames[i].camera;
    CHECK((a.world_to_camera - b.world_to_camera).norm() < 1e-12);
    CHECK(std::array{a.fx, a.fy, a.cx, a.cy, a.k1} == std::array{b.fx, b.fy, b.cx, b.cy, b.k1});
    CHECK(copy.frames[i].held_out == capture.frames[i].held_out);
    CHECK(copy.frames[i].body_frame == capture.frames[i].body_frame);
    CHECK(cv::norm(copy.image(i), capture.image(i), cv::NORM_INF) == 0);
    CHECK(cv::norm(copy.mask(i), capture.mask(i), cv::NORM_INF) == 0);
  }
  CHECK(copy.fps == capture.fps);
  CHECK(copy.scene_box_given == capture.scene_box_given);  // it decides on the space of the scene
  CHECK((copy.scene_box.min - capture.scene_box.min).norm() < 1e-12);
  CHECK((copy.scene_box.max - capture.scene_box.max).norm() < 1e-12);
  CHECK(copy.points.positions == capture.points.positions);
  CHECK(copy.human->body.vertices == capture.human->body.vertices);
  CHECK(copy.human->poses.pose == capture.human->poses.pose);
  CHECK(copy.human->exact);
  // The pictures themselves stay behind: only reading one asks for them.
  std::filesystem::remove_all(folder / "images");
  const Capture alone = load_capture(folder / "moved/capture", PictureCheck::when_read);
  CHECK(contains(error_of([&] { alone.image(0); }), "images/0.png' does not exist"));
}

TEST_CASE("capture: the examples of the documentation load") {
  const TemporaryFolder folder;
  const std::string text =
      read_whole_file(std::filesystem::path(VIVANT_SOURCE_DIR) / "docs/capture-format.md");
  std::vector<std::string> examples;
  const std::string open = "```json\n";
  for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at + 1)) {
    examples.push_back(text.substr(at + open.size(), text.find("```", at + 3) - at - open.size()));
  }
  REQUIRE(examples.size() == 3);
  write_file(folder / "transforms.json", examples[0]);
  const Capture capture = load_capture(folder.path(), PictureCheck::when_read);
  CHECK(capture.frames.size() == 2);
  CHECK((capture.frames[1].camera.forward() - Vector3d(0, 0, -1)).norm() < 1e-12);
  CHECK(json::parse(examples[1])["body_frame"] == 0);
  write_file(folder / "path.json", examples[2]);
  CHECK(read_camera_path(folder / "path.json").cameras.size() == 2);
}

TEST_CASE("capture: a static scene's focus and up direction") {
  const Camera reference{.width = 64, .height = 48, .fx = 60, .fy = 60, .cx = 32, .cy = 24};
  Capture capture;
  const Vector3d target(1, 2, 3), up(0, 0, 1);
  for (int i = 0; i < 12; ++i) {
    CaptureFrame frame;
    frame.camera = reference;
    const double angle = i * M_PI / 6;
    frame.camera.world_to_camera =
        look_at(target + Vector3d(4 * std::cos(angle), 4 * std::sin(angle), 1), target, up);
    capture.frames.push_back(frame);
  }
  CHECK((focus_point(capture) - target).norm() < 1e-4);
  CHECK((up_direction(capture) - up).norm() < 1e-9);
}

TEST_CASE("capture: tennis, a camera that only rotates") {
  const auto path = shared_data("tennis");
  if (path.empty()) return;
  const Capture capture = load_capture(path);
  CHECK(capture.frames.size() == 70);
  CHECK(capture.held_out_frames().size() == 7);
  CHECK(capture.human->poses.shape.size() == 7);
  CHECK(camera_only_rotates(capture));
  CHECK(capture.image(0).size() == cv::Size(448, 256));
  // The fitted body projects into the mask: the fit's silhouette has an IoU of at least 0.67 in every frame.
  const Body body = shaped(capture.human->body, capture.human->poses.shape);
  for (int frame : {0, 35, 69}) {
    const int row = capture.frames[frame].body_frame;
    const Motion& poses = capture.human->poses;
    const cv::Mat mask = capture.mask(frame);
    int inside = 0;
    const auto vertices = posed_vertices(body, poses, row);
    for (const Vector3d& vertex : vertices) {
      const Vector3d pixel = capture.frames[frame].camera.project(vertex);
      const cv::Point at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      if (pixel.z() > 0 && cv::Rect(0, 0, mask.cols, mask.rows).contains(at))
        inside += mask.at<std::uint8_t>(at) != 0;
    }
    CHECK(inside > 0.75 * static_cast<double>(vertices.size()));
  }
  MESSAGE("tennis scene box: ", capture.scene_box.min.transpose(), " to ", capture.scene_box.max.transpose());
}

TEST_CASE("capture: fox at both sizes, with distortion and sparse points") {
  for (const auto& [name, width] :
       {std::pair{"fox/transforms.json", 540}, std::pair{"fox/transforms_4.json", 270}}) {
    const auto path = shared_data(name);
    if (path.empty()) return;
    const Capture capture = load_capture(path);
    CHECK(capture.frames.size() == 50);
    CHECK(capture.held_out_frames() == std::vector<int>{0, 8, 16, 24, 32, 40, 48});
    CHECK_FALSE(capture.human.has_value());
    CHECK(capture.frames[0].camera.width == width);
    CHECK(capture.image(0).cols == width);
    CHECK(cv::countNonZero(capture.mask(0)) == 0);
    CHECK(capture.frames[0].camera.distorted());
    CHECK(capture.points.positions.size() == 11728);
    CHECK_FALSE(camera_only_rotates(capture));
    // Most sparse points lie in front of the first camera and inside the derived box.
    int in_front = 0, in_box = 0;
    for (const auto& point : capture.points.positions) {
      const Vector3d p = point.cast<double>();
      in_front += capture.frames[0].camera.project(p).z() > 0;
      in_box += (p.array() >= capture.scene_box.min.array()).all() &&
                (p.array() <= capture.scene_box.max.array()).all();
    }
    CHECK(in_front > 0.9 * 11728);
    CHECK(in_box > 0.85 * 11728);
  }
}

TEST_CASE("capture: a held-out frame takes a spline's shares of the rows around it") {
  using Shares = std::vector<std::pair<int, double>>;
  Capture capture;
  capture.frames.resize(12);
  for (const int held_out : {0, 3, 6, 7, 10}) capture.frames[held_out].held_out = true;
  const std::vector<int> trained = capture.training_frames();  // 1 2 4 5 8 9 11
  CHECK(capture.training_rows(0) == Shares{{0, 1.0}});
  CHECK(capture.training_rows(4) == Shares{{2, 1.0}});
  const Shares middle = capture.training_rows(3);
  REQUIRE(middle.size() == 4);
  for (int k = 0; k < 4; ++k) {
    CHECK(middle[k].first == k);
    CHECK(std::abs(middle[k].second - (k == 0 || k == 3 ? -1.0 : 7.0) / 12) < 1e-12);
  }
  for (const int frame : {3, 6, 7, 10}) {  // what moves evenly goes on to
    double sum = 0, place = 0;
    for (const auto& [row, share] : capture.training_rows(frame)) {
      sum += share;
      place += share * trained[row];
    }
    CHECK(std::abs(sum - 1) < 1e-12);
    CHECK(std::abs(place - frame) < 1e-12);
  }
  CHECK(capture.training_rows(10).back().first == 6);  // the last row there is
}
