#include "vivant/data/camera_path.hpp"

#include <nlohmann/json.hpp>

#include "io_helpers.hpp"

using namespace vivant;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Camera reference_camera() {
  Camera camera{.width = 64, .height = 48, .fx = 70, .fy = 71, .cx = 32, .cy = 24};
  camera.k1 = 0.01;
  camera.world_to_camera = look_at({0, 1.5, 4}, {0.3, 1, 0}, {0, 1, 0});
  return camera;
}

}  // namespace

TEST_CASE("camera path: an orbit keeps distance, height and framing") {
  const Camera reference = reference_camera();
  const Vector3d centre(0.3, 1, -0.5), up(0, 1, 0);
  const auto cameras = orbit(reference, centre, up, -30, 90, 5);
  REQUIRE(cameras.size() == 5);
  CHECK((cameras[1].world_to_camera - reference.world_to_camera).norm() < 1e-12);
  for (const Camera& camera : cameras) {
    CHECK(camera.centre().y() == doctest::Approx(1.5));
    CHECK((camera.centre() - centre).norm() == doctest::Approx((reference.centre() - centre).norm()));
    CHECK((camera.project(centre) - reference.project(centre)).norm() < 1e-9);
    CHECK((camera.project(centre + up) - reference.project(centre + up)).norm() < 1e-9);
  }
  // Positive angles go counter-clockwise seen from above: from +z towards +x.
  CHECK(cameras[4].centre().x() > centre.x() + 4);
  const auto turn = orbit(reference, centre, up, 0, 360, 4);
  CHECK((turn[2].centre() - centre + reference.centre() - centre).head<1>().norm() < 1e-9);
  CHECK((turn[3].centre() - turn[0].centre()).norm() > 1);
}

TEST_CASE("camera path: written and read again it is the same; bad files give one clear line") {
  const TemporaryFolder folder;
  const CameraPath path{.fps = 12, .cameras = orbit(reference_camera(), {0, 1, 0}, {0, 1, 0}, -20, 20, 3)};
  write_camera_path(folder / "path.json", path);
  const CameraPath read = read_camera_path(folder / "path.json");
  CHECK(read.fps == 12);
  REQUIRE(read.cameras.size() == 3);
  for (int i = 0; i < 3; ++i) {
    CHECK((read.cameras[i].world_to_camera - path.cameras[i].world_to_camera).norm() < 1e-12);
    CHECK(read.cameras[i].fy == 71);
    CHECK(read.cameras[i].k1 == 0.01);
  }
  const auto error = [&](const std::string& text) {
    write_file(folder / "bad.json", text);
    return error_of([&] { read_camera_path(folder / "bad.json"); });
  };
  CHECK(contains(error("{\n\"frames\": [\n"), "line 3: broken JSON"));
  CHECK(contains(error("[]"), "JSON object"));
  CHECK(contains(error(R"({"frames": []})"), "'frames'"));
  CHECK(contains(error(R"({"fl_x": 3, "frames": [{}]})"), "frame 0: 'w' and 'h' are missing"));
  CHECK(contains(error(R"({"fl_x": 3, "w": 4, "h": 4, "frames": [{}]})"), "'transform_matrix' is missing"));
}
