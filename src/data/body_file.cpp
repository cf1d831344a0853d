// load_body and save_body: the safetensors form and SMPL models.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "vivant/data/body.hpp"
#include "vivant/io/npz.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr int smpl_influences = 4;

/// SMPL's joints in the order of its files.
const char* const smpl_joint_names[] = {
    "pelvis",     "left_hip",    "right_hip",    "spine1",      "left_knee",     "right_knee",
    "spine2",     "left_ankle",  "right_ankle",  "spine3",      "left_foot",     "right_foot",
    "neck",       "left_collar", "right_collar", "head",        "left_shoulder", "right_shoulder",
    "left_elbow", "right_elbow", "left_wrist",   "right_wrist", "left_hand",     "right_hand"};

std::vector<Vector3d> to_points(std::span<const double> values) {
  std::vector<Vector3d> points(values.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  return points;
}

std::vector<Vector3i> read_triangles(const TensorFile& file, const std::string& name, std::size_t limit) {
  std::vector<std::int64_t> indices = file.at(name, {-1, 3}).as_ints();
  std::vector<Vector3i> triangles(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0 || indices[i] >= static_cast<std::int64_t>(limit)) {
      fail("{}: tensor '{}' names vertex {} of {} in triangle {}", file.source, name, indices[i], limit,
           i / 3);
    }
    triangles[i / 3][static_cast<int>(i % 3)] = static_cast<int>(indices[i]);
  }
  return triangles;
}

std::vector<int> checked_parents(const TensorFile& file, const std::vector<std::int64_t>& values) {
  std::vector<int> parents;
  for (std::size_t j = 0; j < values.size(); ++j) {
    const bool root = j == 0;
    if (root != (values[j] < 0) || values[j] >= static_cast<std::int64_t>(j)) {
      fail("{}: joint {} has parent {}; joint 0 is the root (-1), parents come before their children",
           file.source, j, values[j]);
    }
    parents.push_back(root ? -1 : static_cast<int>(values[j]));
  }
  return parents;
}

/// Checks indices and sums, and makes every row sum to 1 exactly.
void check_skinning(const TensorFile& file, Body& body) {
  const std::size_t count = body.influences;
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    double sum = 0;
    for (std::size_t at = v * count; at < (v + 1) * count; ++at) {
      if (body.skin_joints[at] < 0 || body.skin_joints[at] >= body.joint_count()) {
        fail("{}: vertex {} is bound to joint {} of {}", file.source, v, body.skin_joints[at],
             body.joint_count());
      }
      if (body.skin_weights[at] < 0) fail("{}: vertex {} has a negative skinning weight", file.source, v);
      sum += body.skin_weights[at];
    }
    if (std::abs(sum - 1) > 1e-3)
      fail("{}: the skinning weights of vertex {} sum to {}, not 1", file.source, v, sum);
    for (std::size_t at = v * count; at < (v + 1) * count; ++at) body.skin_weights[at] /= sum;
  }
}

std::vector<std::string> split_names(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream stream(text);
  for (std::string name; std::getline(stream, name, ',');) names.push_back(name);
  return names;
}

Body body_from_tensors(const TensorFile& file) {
  Body body;
  body.vertices = to_points(file.finite_doubles("v_template", {-1, 3}));
  body.triangles = read_triangles(file, "faces", body.vertices.size());
  body.joints = to_points(file.finite_doubles("joints", {-1, 3}));
  const auto vertex_count = static_cast<std::int64_t>(body.vertices.size());
  const auto joint_count = static_cast<std::int64_t>(body.joints.size());
  if (vertex_count == 0 || joint_count == 0) fail("{}: a body needs vertices and joints", file.source);
  body.parents = checked_parents(file, file.at("parents", {joint_count}).as_ints());
  const HostTensor& skin_joints = file.at("skin_idx", {vertex_count, -1});
  body.influences = static_cast<int>(skin_joints.shape[1]);
  for (std::int64_t joint : skin_joints.as_ints()) body.skin_joints.push_back(static_cast<int>(joint));
  body.skin_weights = file.finite_doubles("skin_w", {vertex_count, body.influences});
  check_skinning(file, body);
  if (file.contains("uv")) {
    const std::vector<double> uv = file.finite_doubles("uv", {-1, 2});
    for (std::size_t i = 0; i < uv.size(); i += 2) body.uv.emplace_back(uv[i], uv[i + 1]);
    body.uv_triangles = read_triangles(file, "faces_uv", body.uv.size());
    if (body.uv_triangles.size() != body.triangles.size()) {
      fail("{}: 'faces_uv' has {} triangles, 'faces' has {}", file.source, body.uv_triangles.size(),
           body.triangles.size());
    }
  }
  if (file.contains("tails")) body.tails = to_points(file.finite_doubles("tails", {joint_count, 3}));
  if (file.contains("shape_dirs")) {
    const std::int64_t shapes = file.at("shape_dirs", {-1, vertex_count, 3}).shape[0];
    const std::vector<double> vertex_dirs = file.finite_doubles("shape_dirs", {shapes, vertex_count, 3});
    const std::vector<double> joint_dirs = file.finite_doubles("joint_dirs", {shapes, joint_count, 3});
    for (std::int64_t s = 0; s < shapes; ++s) {
      body.shape_dirs.push_back(
          to_points(std::span(vertex_dirs).subspan(s * vertex_count * 3, vertex_count * 3)));
      body.joint_dirs.push_back(
          to_points(std::span(joint_dirs).subspan(s * joint_count * 3, joint_count * 3)));
    }
  }
  if (file.metadata.count("joint_names")) body.joint_names = split_names(file.metadata.at("joint_names"));
  if (static_cast<std::int64_t>(body.joint_names.size()) != joint_count) {
    fail("{}: the metadata 'joint_names' name {} joints, the body has {}", file.source,
         body.joint_names.size(), joint_count);
  }
  return body;
}

/// The four largest weights of each row of [V, J], renormalised.
void keep_largest_weights(const TensorFile& file, Body& body) {
  const std::size_t joint_count = body.joints.size();
  const auto vertex_count = static_cast<std::int64_t>(body.vertices.size());
  const std::vector<double> weights =
      file.finite_doubles("weights", {vertex_count, static_cast<std::int64_t>(joint_count)});
  body.influences = std::min<int>(smpl_influences, static_cast<int>(joint_count));
  std::vector<int> order(joint_count);
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    const double* row = weights.data() + v * joint_count;
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return row[a] > row[b]; });
    double sum = 0;
    for (int k = 0; k < body.influences; ++k) sum += row[order[k]];
    if (!(sum > 0)) fail("{}: vertex {} has no skinning weight", file.source, v);
    for (int k = 0; k < body.influences; ++k) {
      body.skin_joints.push_back(order[k]);
      body.skin_weights.push_back(row[order[k]] / sum);
    }
  }
}

/// points' = regressor [J, V] points [V, 3].
std::vector<Vector3d> regress(const std::vector<double>& regressor, const std::vector<Vector3d>& points) {
  std::vector<Vector3d> out(regressor.size() / points.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < regressor.size(); ++i) {
    if (regressor[i] != 0) out[i / points.size()] += regressor[i] * points[i % points.size()];
  }
  return out;
}

Body body_from_smpl(const TensorFile& file) {
  if (file.metadata.count("skipped") && !file.contains("J_regressor")) {
    fail("{}: arrays that hold Python objects cannot be read ({}); save them as plain dense arrays",
         file.source, file.metadata.at("skipped"));
  }
  Body body;
  body.vertices = to_points(file.finite_doubles("v_template", {-1, 3}));
  if (body.vertices.empty()) fail("{}: a body needs vertices", file.source);
  const auto vertex_count = static_cast<std::int64_t>(body.vertices.size());
  body.triangles = read_triangles(file, "f", body.vertices.size());
  const std::vector<double> regressor = file.finite_doubles("J_regressor", {-1, vertex_count});
  body.joints = regress(regressor, body.vertices);
  const auto joint_count = static_cast<std::int64_t>(body.joints.size());
  std::vector<std::int64_t> parents = file.at("kintree_table", {2, joint_count}).as_ints();
  parents.resize(joint_count);
  // SMPL files hold the root's parent as 2^32 - 1.
  if (!parents.empty() && parents[0] == 4294967295) parents[0] = -1;
  body.parents = checked_parents(file, parents);
  keep_largest_weights(file, body);
  if (file.contains("shapedirs")) {
    const std::int64_t shapes = file.at("shapedirs", {vertex_count, 3, -1}).shape[2];
    const std::vector<double> dirs = file.finite_doubles("shapedirs", {vertex_count, 3, shapes});
    for (std::int64_t s = 0; s < shapes; ++s) {
      std::vector<Vector3d> direction(body.vertices.size());
      for (std::size_t i = 0; i < direction.size() * 3; ++i) direction[i / 3][i % 3] = dirs[i * shapes + s];
      body.joint_dirs.push_back(regress(regressor, direction));
      body.shape_dirs.push_back(std::move(direction));
    }
  }
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    body.joint_names.push_back(j < std::size(smpl_joint_names) ? smpl_joint_names[j]
                                                               : fmt::format("joint{}", j));
  }
  return body;
}

HostTensor from_points(std::span<const Vector3d> points) {
  std::vector<float> values;
  for (const Vector3d& point : points) {
    for (double value : point) values.push_back(static_cast<float>(value));
  }
  return HostTensor({static_cast<std::int64_t>(points.size()), 3}, std::span<const float>(values));
}

HostTensor from_triangles(const std::vector<Vector3i>& triangles) {
  std::vector<std::int32_t> values;
  for (const Vector3i& triangle : triangles) values.insert(values.end(), triangle.begin(), triangle.end());
  return HostTensor({static_cast<std::int64_t>(triangles.size()), 3}, std::span<const std::int32_t>(values));
}

HostTensor stacked(const std::vector<std::vector<Vector3d>>& rows) {
  std::vector<Vector3d> all;
  for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
  HostTensor tensor = from_points(all);
  tensor.shape = {static_cast<std::int64_t>(rows.size()), static_cast<std::int64_t>(rows[0].size()), 3};
  return tensor;
}

}  // namespace

Body load_body(const std::filesystem::path& path) {
  if (path.extension() == ".npz") return body_from_smpl(read_npz(path));
  if (path.extension() == ".safetensors") return body_from_tensors(read_safetensors(path));
  fail("'{}': a body model is a .safetensors file or an SMPL model as .npz", path.string());
}

void save_body(const std::filesystem::path& path, const Body& body) {
  TensorFile file;
  file.metadata["joint_names"] = fmt::format("{}", fmt::join(body.joint_names, ","));
  const auto vertex_count = static_cast<std::int64_t>(body.vertices.size());
  file.tensors["v_template"] = from_points(body.vertices);
  file.tensors["faces"] = from_triangles(body.triangles);
  file.tensors["joints"] = from_points(body.joints);
  file.tensors["parents"] = HostTensor({body.joint_count()}, std::span<const std::int32_t>(body.parents));
  file.tensors["skin_idx"] =
      HostTensor({vertex_count, body.influences}, std::span<const std::int32_t>(body.skin_joints));
  const std::vector<float> weights(body.skin_weights.begin(), body.skin_weights.end());
  file.tensors["skin_w"] = HostTensor({vertex_count, body.influences}, std::span<const float>(weights));
  if (!body.uv.empty()) {
    std::vector<float> uv;
    for (const auto& point : body.uv) uv.insert(uv.end(), {float(point.x()), float(point.y())});
    file.tensors["uv"] =
        HostTensor({static_cast<std::int64_t>(body.uv.size()), 2}, std::span<const float>(uv));
    file.tensors["faces_uv"] = from_triangles(body.uv_triangles);
  }
  if (!body.tails.empty()) file.tensors["tails"] = from_points(body.tails);
  if (!body.shape_dirs.empty()) {
    file.tensors["shape_dirs"] = stacked(body.shape_dirs);
    file.tensors["joint_dirs"] = stacked(body.joint_dirs);
  }
  write_safetensors(path, file);
}

}  // namespace vivant
