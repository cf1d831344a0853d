#include "vivant/data/camera_table.hpp"

#include "vivant/runtime/error.hpp"

namespace vivant {

std::vector<float> camera_table(std::span<const Camera> cameras) {
  std::vector<float> table;
  for (const Camera& camera : cameras) {
    if (camera.width != cameras[0].width || camera.height != cameras[0].height)
      fail("[camera_table] a camera has images of {}x{} pixels, the first of {}x{}", camera.width,
           camera.height, cameras[0].width, cameras[0].height);
    for (double number :
         {camera.fx, camera.fy, camera.cx, camera.cy, camera.k1, camera.k2, camera.p1, camera.p2})
      table.push_back(static_cast<float>(number));
    const Eigen::Vector3d centre = camera.centre();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        table.push_back(static_cast<float>(camera.world_to_camera(column, row)));
      table.push_back(static_cast<float>(centre[row]));
    }
  }
  return table;
}

}  // namespace vivant
