// load_capture: transforms.json to a checked Capture.
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <set>

#include "vivant/data/capture.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/json.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using nlohmann::json;

namespace {

constexpr int held_out_every = 8;

/// Reads values of one frame, or of the whole file where the frame has none. Messages name the file and the
/// frame.
class Fields {
 public:
  Fields(std::string where, const json& frame, const json& whole)
      : where_(std::move(where)), frame_(frame), whole_(whole) {}

  const std::string& where() const { return where_; }

  std::optional<double> number(const char* key) const {
    const json* value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_number()) fail("{}: '{}' must be a number", where_, key);
    const double number = value->get<double>();
    if (!std::isfinite(number)) fail("{}: '{}' is not finite", where_, key);
    return number;
  }

  std::optional<int> size(const char* key) const {
    const std::optional<double> value = number(key);
    if (!value) return std::nullopt;
    if (*value < 1 || *value > 100000 || *value != std::floor(*value)) {
      fail("{}: '{}' is {}, a number of pixels is needed", where_, key, *value);
    }
    return static_cast<int>(*value);
  }

  std::optional<std::string> text(const char* key) const {
    const json* value = find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_string() || value->get<std::string>().empty())
      fail("{}: '{}' must be a text", where_, key);
    return value->get<std::string>();
  }

  const json* find(const char* key) const {
    for (const json* level : {&frame_, &whole_}) {
      const auto found = level->find(key);
      if (found != level->end() && !found->is_null()) return &*found;
    }
    return nullptr;
  }

 private:
  std::string where_;
  const json& frame_;
  const json& whole_;
};

Matrix4d read_pose(const Fields& fields) {
  const json* rows = fields.find("transform_matrix");
  if (rows == nullptr) fail("{}: 'transform_matrix' is missing", fields.where());
  Matrix4d matrix;
  bool well_formed = rows->is_array() && rows->size() == 4;
  for (int r = 0; well_formed && r < 4; ++r) {
    const json& row = (*rows)[r];
    well_formed = row.is_array() && row.size() == 4;
    for (int c = 0; well_formed && c < 4; ++c) {
      well_formed = row[c].is_number();
      if (well_formed) matrix(r, c) = row[c].get<double>();
    }
  }
  if (!well_formed) fail("{}: 'transform_matrix' must be 4 rows of 4 numbers", fields.where());
  if (!matrix.allFinite()) fail("{}: 'transform_matrix' is not finite", fields.where());
  const Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error = (rotation.transpose() * rotation - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool last_row = (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-6;
  if (error > 1e-3 || rotation.determinant() < 0 || !last_row) {
    fail("{}: 'transform_matrix' must be a rotation and a translation, camera to world", fields.where());
  }
  return matrix;
}

void check_camera_model(const Fields& fields) {
  const std::string model = fields.text("camera_model").value_or("OPENCV");
  static const std::set<std::string> known = {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                              "RADIAL"};
  if (known.count(model) == 0)
    fail("{}: camera model '{}' is not supported, undistort the pictures", fields.where(), model);
  for (const char* key : {"k3", "k4"}) {
    if (fields.number(key).value_or(0) != 0) {
      fail("{}: distortion '{}' is not supported, only k1, k2, p1 and p2", fields.where(), key);
    }
  }
}

double focal_length(const Fields& fields, const char* length_key, const char* angle_key, int size,
                    double fallback) {
  if (const auto length = fields.number(length_key)) {
    if (*length <= 0) fail("{}: '{}' is {}, it must be positive", fields.where(), length_key, *length);
    return *length;
  }
  const auto angle = fields.number(angle_key);
  if (!angle) return fallback;
  if (*angle <= 0 || *angle >= M_PI)
    fail("{}: '{}' is {}, radians below pi are needed", fields.where(), angle_key, *angle);
  return 0.5 * size / std::tan(0.5 * *angle);
}

/// The camera at the size that the file states; `picture` stands in when it states none.
Camera read_camera(const Fields& fields, const std::optional<cv::Size>& picture) {
  check_camera_model(fields);
  Camera camera;
  const auto width = fields.size("w"), height = fields.size("h");
  if (width.has_value() != height.has_value()) fail("{}: 'w' and 'h' must stand together", fields.where());
  if (!width && !picture) fail("{}: 'w' and 'h' are missing", fields.where());
  camera.width = width ? *width : picture->width;
  camera.height = height ? *height : picture->height;
  camera.fx = focal_length(fields, "fl_x", "camera_angle_x", camera.width, 0);
  camera.fy = focal_length(fields, "fl_y", "camera_angle_y", camera.height, camera.fx);
  if (camera.fx == 0) fail("{}: the focal length ('fl_x' or 'camera_angle_x') is missing", fields.where());
  camera.cx = fields.number("cx").value_or(0.5 * camera.width);
  camera.cy = fields.number("cy").value_or(0.5 * camera.height);
  camera.k1 = fields.number("k1").value_or(0);
  camera.k2 = fields.number("k2").value_or(0);
  camera.p1 = fields.number("p1").value_or(0);
  camera.p2 = fields.number("p2").value_or(0);
  camera.set_opengl_camera_to_world(read_pose(fields));
  return camera;
}

/// The camera for pictures stored at another size than the file states; the aspect ratio must agree to a
/// pixel.
Camera fitted(const Camera& camera, const cv::Size& picture, const std::string& image) {
  if (picture.width == camera.width && picture.height == camera.height) return camera;
  const double expected = static_cast<double>(camera.width) * picture.height / camera.height;
  if (std::abs(expected - picture.width) > 1) {
    fail("{}: the picture is {}x{}, 'w' and 'h' say {}x{}: another aspect ratio", image, picture.width,
         picture.height, camera.width, camera.height);
  }
  return camera.resized(picture.width, picture.height);
}

/// NeRF's synthetic captures leave out ".png".
fs::path picture_path(const fs::path& folder, const std::string& name) {
  fs::path path = (folder / name).lexically_normal();
  if (!path.has_extension() && !fs::exists(path)) path += ".png";
  return path;
}

void read_mask_name(const Fields& fields, const fs::path& folder, CaptureFrame& frame) {
  const auto human = fields.text("human_mask_path"), kept = fields.text("mask_path");
  if (!human && !kept) return;
  frame.mask_name = human ? *human : *kept;
  frame.mask_keeps = !human;
  frame.mask_path = picture_path(folder, frame.mask_name);
}

CaptureFrame read_frame(const Fields& fields, const fs::path& folder, PictureCheck check) {
  CaptureFrame frame;
  const auto name = fields.text("file_path");
  if (!name) fail("{}: 'file_path' is missing", fields.where());
  frame.name = *name;
  frame.image_path = picture_path(folder, frame.name);
  read_mask_name(fields, folder, frame);
  std::optional<cv::Size> picture;
  if (check == PictureCheck::now) picture = inspect_image(frame.image_path);
  frame.camera = read_camera(fields, picture);
  if (picture) frame.camera = fitted(frame.camera, *picture, frame.image_path.string());
  if (picture && !frame.mask_name.empty()) {
    const cv::Size mask = inspect_image(frame.mask_path);
    if (mask != *picture) {
      fail("{}: the mask is {}x{}, its picture {}x{}", frame.mask_path.string(), mask.width, mask.height,
           picture->width, picture->height);
    }
  }
  return frame;
}

void read_human(const json& whole, const std::string& file, const fs::path& folder, Capture& capture) {
  const auto found = whole.find("human");
  if (found == whole.end() || found->is_null()) return;
  if (!found->is_object()) fail("{}: 'human' must be an object with 'body' and 'poses'", file);
  const Fields fields(file + ": 'human'", *found, *found);
  const auto body = fields.text("body"), poses = fields.text("poses");
  if (!body || !poses) fail("{}: 'human' must have '{}'", file, body ? "poses" : "body");
  CaptureHuman human{.body = load_body(folder / *body), .poses = load_poses(folder / *poses)};
  check_motion(human.poses, human.body.joint_count(), (folder / *poses).string());
  if (human.poses.shape.size() > human.body.shape_dirs.size()) {
    fail("{}: {} shape coefficients, the body has {} shape directions", (folder / *poses).string(),
         human.poses.shape.size(), human.body.shape_dirs.size());
  }
  human.poses.fps = capture.fps;
  capture.human = std::move(human);
}

void read_body_frame(const Fields& fields, const Capture& capture, CaptureFrame& frame) {
  if (!capture.human) return;
  const auto row = fields.number("body_frame");
  if (!row) return;
  const int count = capture.human->poses.frame_count();
  if (*row != std::floor(*row) || *row < 0 || *row >= count) {
    fail("{}: 'body_frame' is {}, the poses have {} frames", fields.where(), *row, count);
  }
  frame.body_frame = static_cast<int>(*row);
}

void read_splits(const json& whole, const std::string& file, Capture& capture) {
  const auto splits = whole.find("splits");
  const bool given = splits != whole.end() && !splits->is_null();
  if (!given) {
    for (std::size_t i = 0; capture.frames.size() > 1 && i < capture.frames.size(); i += held_out_every) {
      capture.frames[i].held_out = true;
    }
    return;
  }
  if (!splits->is_object() || !splits->contains("test") || !(*splits)["test"].is_array()) {
    fail("{}: 'splits' must be an object whose 'test' lists the held-out frames", file);
  }
  for (const json& name : (*splits)["test"]) {
    if (!name.is_string()) fail("{}: 'splits.test' must list the frames' file_path", file);
    bool found = false;
    for (CaptureFrame& frame : capture.frames) {
      if (frame.name != name.get<std::string>()) continue;
      frame.held_out = found = true;
    }
    if (!found)
      fail("{}: 'splits.test' names '{}', no frame has this file_path", file, name.get<std::string>());
  }
  if (capture.training_frames().empty())
    fail("{}: 'splits.test' holds out every frame, none is left for training", file);
}

void read_scene_box(const json& whole, const std::string& file, Capture& capture) {
  const auto found = whole.find("scene_box");
  capture.scene_box_given = found != whole.end() && !found->is_null();
  if (!capture.scene_box_given) {
    capture.scene_box = derived_scene_box(capture);
    return;
  }
  bool well_formed = found->is_array() && found->size() == 2;
  for (int corner = 0; well_formed && corner < 2; ++corner) {
    const json& values = (*found)[corner];
    well_formed = values.is_array() && values.size() == 3;
    for (int axis = 0; well_formed && axis < 3; ++axis) {
      well_formed = values[axis].is_number();
      if (well_formed)
        (corner == 0 ? capture.scene_box.min : capture.scene_box.max)[axis] = values[axis].get<double>();
    }
  }
  if (!well_formed || !capture.scene_box.size().allFinite() || !(capture.scene_box.size().minCoeff() > 0)) {
    fail("{}: 'scene_box' must be [[min x, y, z], [max x, y, z]] with each minimum below its maximum", file);
  }
}

}  // namespace

Capture load_capture(const fs::path& path, PictureCheck check) {
  Capture capture;
  capture.source = fs::is_directory(path) ? path / "transforms.json" : path;
  const std::string file = capture.source.string();
  const json whole = read_json(capture.source);
  if (!whole.is_object()) fail("{}: a capture is a JSON object", file);
  const auto frames = whole.find("frames");
  if (frames == whole.end() || !frames->is_array() || frames->empty())
    fail("{}: 'frames' must be a list of frames", file);
  const fs::path folder = capture.source.has_parent_path() ? capture.source.parent_path() : fs::path(".");
  const Fields global(file, whole, whole);
  capture.fps = global.number("fps").value_or(capture.fps);
  if (!(capture.fps > 0)) fail("{}: 'fps' is {}, it must be positive", file, capture.fps);
  read_human(whole, file, folder, capture);
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const json& entry = (*frames)[i];
    const std::string where = fmt::format("{}: frame {}", file, i);
    if (!entry.is_object()) fail("{}: it must be an object", where);
    const Fields fields(where, entry, whole);
    capture.frames.push_back(read_frame(fields, folder, check));
    read_body_frame(fields, capture, capture.frames.back());
  }
  if (capture.human && std::none_of(capture.frames.begin(), capture.frames.end(),
                                    [](const CaptureFrame& frame) { return frame.body_frame >= 0; })) {
    fail("{}: it has a 'human', but no frame has a 'body_frame'", file);
  }
  if (const auto points = global.text("ply_file_path")) capture.points = read_ply(folder / *points);
  read_splits(whole, file, capture);
  read_scene_box(whole, file, capture);
  return capture;
}

}  // namespace vivant
