#include "vivant/data/body_silhouette.hpp"

#include <algorithm>

#include "vivant/data/rasterise.hpp"

namespace vivant {
namespace {

/// The limb of every joint, -1 for those of the trunk.
std::vector<int> limbs_of_joints(const Body& body) {
  std::vector<int> result;
  for (int joint = 0; joint < body.joint_count(); ++joint) {
    const std::string& name = body.joint_names[joint];
    const auto found = std::ranges::find_if(
        limbs, [&](const Limb& limb) { return std::ranges::find(limb.joints, name) != limb.joints.end(); });
    const int parent = body.parents[joint];
    const int above = parent < 0 ? -1 : result[parent];
    result.push_back(found == limbs.end() ? above : static_cast<int>(found - limbs.begin()));
  }
  return result;
}

int strongest_joint(const Body& body, int vertex) {
  const auto weights = body.skin_weights.begin() + static_cast<std::ptrdiff_t>(vertex) * body.influences;
  const auto strongest = std::max_element(weights, weights + body.influences);
  return body.skin_joints[strongest - body.skin_weights.begin()];
}

}  // namespace

BodySilhouette body_silhouette(const Body& body, std::span<const Eigen::Vector3d> vertices,
                               const Camera& camera) {
  const Visibility seen = rasterise(camera, vertices, body.triangles);
  const std::vector<int> limb_of_joint = limbs_of_joints(body);
  BodySilhouette silhouette{cv::Mat(seen.height, seen.width, CV_8UC1, cv::Scalar(0)),
                            cv::Mat(seen.height, seen.width, CV_32SC1, cv::Scalar(-1))};
  for (std::size_t pixel = 0; pixel < seen.triangle.size(); ++pixel) {
    if (seen.triangle[pixel] < 0) continue;
    const int vertex = body.triangles[seen.triangle[pixel]][0];
    silhouette.mask.data[pixel] = 255;
    silhouette.limb.ptr<int>()[pixel] = limb_of_joint[strongest_joint(body, vertex)];
  }
  return silhouette;
}

BodySilhouette posed_silhouette(const Body& body, const Pose& pose, const Eigen::Vector3d& translation,
                                const Camera& camera, double units_per_metre) {
  std::vector<Eigen::Vector3d> vertices = posed_vertices(body, pose, translation);
  for (Eigen::Vector3d& vertex : vertices) vertex *= units_per_metre;
  return body_silhouette(body, vertices, camera);
}

}  // namespace vivant
