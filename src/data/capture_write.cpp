// write_capture and copy_capture_essentials.
#include <nlohmann/json.hpp>

#include "camera_json.hpp"
#include "vivant/data/capture.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

ordered_json frame_entry(const CaptureFrame& frame, const ordered_json& shared) {
  ordered_json entry = {{"file_path", frame.name}};
  if (!frame.mask_name.empty()) entry[frame.mask_keeps ? "mask_path" : "human_mask_path"] = frame.mask_name;
  const ordered_json own = intrinsics_json(frame.camera);
  for (const auto& [key, value] : own.items()) {
    if (shared.at(key) != value) entry[key] = value;
  }
  entry["transform_matrix"] = transform_json(frame.camera);
  if (frame.body_frame >= 0) entry["body_frame"] = frame.body_frame;
  return entry;
}

}  // namespace

void write_capture(const Capture& capture, const fs::path& folder) {
  if (capture.frames.empty()) fail("'{}': a capture needs frames", folder.string());
  make_folder(folder);
  const ordered_json shared = intrinsics_json(capture.frames[0].camera);
  ordered_json whole = {{"camera_model", "OPENCV"}};
  whole.update(shared);
  whole["fps"] = capture.fps;
  if (capture.human) {
    save_body(folder / "body.safetensors", capture.human->body);
    save_poses(folder / "poses.safetensors", capture.human->poses);
    whole["human"] = {{"body", "body.safetensors"}, {"poses", "poses.safetensors"}};
    if (capture.human->exact) whole["human"]["exact"] = true;
  }
  if (!capture.points.positions.empty()) {
    write_ply(folder / "points.ply", capture.points);
    whole["ply_file_path"] = "points.ply";
  }
  if (capture.scene_box_given) {
    const Box& box = capture.scene_box;
    whole["scene_box"] = {{box.min.x(), box.min.y(), box.min.z()}, {box.max.x(), box.max.y(), box.max.z()}};
  }
  ordered_json test = ordered_json::array();
  for (int index : capture.held_out_frames()) test.push_back(capture.frames[index].name);
  whole["splits"] = {{"test", test}};
  whole["frames"] = ordered_json::array();
  for (const CaptureFrame& frame : capture.frames) whole["frames"].push_back(frame_entry(frame, shared));
  // Last: a folder whose transforms.json exists is complete.
  write_text_file(folder / "transforms.json", whole.dump(1) + "\n");
}

void copy_capture_essentials(const Capture& capture, const fs::path& run_folder) {
  Capture copy = capture;
  for (CaptureFrame& frame : copy.frames) {
    frame.name = fs::absolute(frame.image_path).lexically_normal().string();
    if (!frame.mask_name.empty()) frame.mask_name = fs::absolute(frame.mask_path).lexically_normal().string();
  }
  write_capture(copy, run_folder / "capture");
}

}  // namespace vivant
