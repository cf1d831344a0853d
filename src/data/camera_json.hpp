#pragma once
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "vivant/data/camera.hpp"

namespace vivant {

/// Reads values of one frame, or of the whole file where the frame has none. Messages name the file and the
/// frame.
class Fields {
 public:
  Fields(std::string where, const nlohmann::json& frame, const nlohmann::json& whole)
      : where_(std::move(where)), frame_(frame), whole_(whole) {}

  const std::string& where() const { return where_; }
  /// The value of a key; null counts as absent.
  const nlohmann::json* find(const char* key) const;
  /// A finite number.
  std::optional<double> number(const char* key) const;
  /// A positive whole number of pixels.
  std::optional<int> size(const char* key) const;
  /// true or false.
  std::optional<bool> flag(const char* key) const;
  /// A text that is not empty.
  std::optional<std::string> text(const char* key) const;

 private:
  std::string where_;
  const nlohmann::json& frame_;
  const nlohmann::json& whole_;
};

/// The camera of a frame in nerfstudio's keys, at the size that the file states; `picture` stands in when it
/// states none.
Camera read_camera(const Fields& fields, const std::optional<cv::Size>& picture);

/// The intrinsics of a camera under the same keys.
nlohmann::ordered_json intrinsics_json(const Camera& camera);
/// camera_to_world in OpenGL axes as rows.
nlohmann::ordered_json transform_json(const Camera& camera);

}  // namespace vivant
