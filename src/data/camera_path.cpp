#include "vivant/data/camera_path.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "camera_json.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/json.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using nlohmann::json;
using nlohmann::ordered_json;

CameraPath read_camera_path(const std::filesystem::path& path) {
  const json whole = read_json(path);
  if (!whole.is_object()) fail("{}: a camera path is a JSON object", path.string());
  const auto frames = whole.find("frames");
  if (frames == whole.end() || !frames->is_array() || frames->empty()) {
    fail("{}: 'frames' must be a list of frames", path.string());
  }
  CameraPath out;
  out.fps = Fields(path.string(), whole, whole).number("fps").value_or(out.fps);
  if (!(out.fps > 0)) fail("{}: 'fps' is {}, it must be positive", path.string(), out.fps);
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const std::string where = fmt::format("{}: frame {}", path.string(), i);
    if (!(*frames)[i].is_object()) fail("{}: it must be an object", where);
    out.cameras.push_back(read_camera(Fields(where, (*frames)[i], whole), std::nullopt));
  }
  return out;
}

void write_camera_path(const std::filesystem::path& path, const CameraPath& camera_path) {
  ordered_json frames = ordered_json::array();
  for (const Camera& camera : camera_path.cameras) {
    ordered_json frame = intrinsics_json(camera);
    frame["transform_matrix"] = transform_json(camera);
    frames.push_back(frame);
  }
  write_text_file(path, ordered_json{{"fps", camera_path.fps}, {"frames", frames}}.dump(1) + "\n");
}

std::vector<Camera> orbit(const Camera& reference, const Vector3d& centre, const Vector3d& up, double from,
                          double to, int count) {
  const bool closed = std::abs(std::abs(to - from) - 360) < 1e-9;
  const int intervals = closed ? count : std::max(1, count - 1);
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = (from + (to - from) * i / intervals) * M_PI / 180;
    // The camera turned by the rotation sees the world as the reference sees the world turned back.
    Matrix4d back = Matrix4d::Identity();
    back.topLeftCorner<3, 3>() = Eigen::AngleAxisd(-angle, up.normalized()).toRotationMatrix();
    back.topRightCorner<3, 1>() = centre - back.topLeftCorner<3, 3>() * centre;
    cameras.push_back(reference);
    cameras.back().world_to_camera = reference.world_to_camera * back;
  }
  return cameras;
}

}  // namespace vivant
