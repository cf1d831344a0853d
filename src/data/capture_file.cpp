// load_capture: transforms.json to a checked Capture.
#include <algorithm>
#include <cmath>
#include <optional>

#include "camera_json.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/json.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int held_out_every = 8;

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
  human.exact = fields.flag("exact").value_or(false);
  capture.human = std::move(human);
}

void read_body_frame(const Fields& fields, const Capture& capture, CaptureFrame& frame) {
  if (!capture.human) return;
  const auto row = fields.number("body_frame");
  if (!row)
    fail("{}: no 'body_frame': with a 'human' every frame needs one; leave out frames without the person",
         fields.where());
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
  if (const auto points = global.text("ply_file_path")) capture.points = read_ply(folder / *points);
  read_splits(whole, file, capture);
  read_scene_box(whole, file, capture);
  return capture;
}

}  // namespace vivant
