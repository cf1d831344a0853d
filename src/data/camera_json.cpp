#include "camera_json.hpp"

#include <Eigen/LU>
#include <set>

#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using nlohmann::json;
using nlohmann::ordered_json;

const json* Fields::find(const char* key) const {
  for (const json* level : {&frame_, &whole_}) {
    const auto found = level->find(key);
    if (found != level->end() && !found->is_null()) return &*found;
  }
  return nullptr;
}

std::optional<double> Fields::number(const char* key) const {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) fail("{}: '{}' must be a number", where_, key);
  const double number = value->get<double>();
  if (!std::isfinite(number)) fail("{}: '{}' is not finite", where_, key);
  return number;
}

std::optional<int> Fields::size(const char* key) const {
  const std::optional<double> value = number(key);
  if (!value) return std::nullopt;
  if (*value < 1 || *value > 100000 || *value != std::floor(*value)) {
    fail("{}: '{}' is {}, a number of pixels is needed", where_, key, *value);
  }
  return static_cast<int>(*value);
}

std::optional<bool> Fields::flag(const char* key) const {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_boolean()) fail("{}: '{}' must be true or false", where_, key);
  return value->get<bool>();
}

std::optional<std::string> Fields::text(const char* key) const {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_string() || value->get<std::string>().empty()) fail("{}: '{}' must be a text", where_, key);
  return value->get<std::string>();
}

namespace {

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

}  // namespace

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

ordered_json intrinsics_json(const Camera& camera) {
  return {{"fl_x", camera.fx}, {"fl_y", camera.fy},  {"cx", camera.cx}, {"cy", camera.cy},
          {"w", camera.width}, {"h", camera.height}, {"k1", camera.k1}, {"k2", camera.k2},
          {"p1", camera.p1},   {"p2", camera.p2}};
}

ordered_json transform_json(const Camera& camera) {
  const Matrix4d matrix = camera.opengl_camera_to_world();
  ordered_json rows = ordered_json::array();
  for (int r = 0; r < 4; ++r) rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  return rows;
}

}  // namespace vivant
