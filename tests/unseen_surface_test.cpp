#include "vivant/model/unseen_surface.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "small_capture.hpp"
#include "vivant/data/camera_path.hpp"
#include "vivant/data/rasterise.hpp"

using namespace vivant;

namespace {

Body body_of(const Capture& capture) { return shaped(capture.human->body, capture.human->poses.shape); }

std::vector<Eigen::Vector3d> posed_in(const Body& body, const Capture& capture, int frame) {
  const int row = capture.frames[frame].body_frame;
  return posed_vertices(body, capture.human->poses.pose[row], capture.human->poses.translation[row]);
}

}  // namespace

TEST_CASE("unseen surface: what pictures show has their colours") {
  const Capture& capture = small_capture();
  const Body body = body_of(capture);
  const std::vector<int> frames = capture.training_frames();
  const SurfaceColours surface = surface_colours(body, capture, frames);
  double difference = 0, of_mean = 0, count = 0;
  for (const int frame : frames) {
    const Camera& camera = capture.frames[frame].camera;
    const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, frame);
    const Visibility seen = rasterise(camera, vertices, body.triangles);
    const cv::Mat image = capture.image(frame), mask = capture.mask(frame);
    const cv::Scalar mean = cv::mean(image, mask);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x) {
        const int triangle = seen.triangle[static_cast<std::size_t>(y) * seen.width + x];
        if (triangle < 0) continue;
        const int vertex = body.triangles[triangle][0];
        CHECK_FALSE(surface.unseen[vertex]);
        if (mask.at<std::uint8_t>(y, x) == 0) continue;
        const cv::Vec3f pixel(image.at<cv::Vec3b>(y, x));
        difference += cv::norm(pixel - surface.colour[vertex]);
        of_mean += cv::norm(pixel - cv::Vec3f(mean[0], mean[1], mean[2]));
        ++count;
      }
  }
  CHECK(count > 1000);
  CHECK(difference < 0.6 * of_mean);
}

TEST_CASE("unseen surface: the other side is seen from the other side, in colours of the pictures") {
  const Capture& capture = small_capture();
  const Body body = body_of(capture);
  const int frame = capture.training_frames().front();
  const std::vector<UnseenView> views = unseen_views(body, capture, {frame}, 1);
  REQUIRE(views.size() == 1);
  CHECK(views[0].row == 0);
  REQUIRE(views[0].rays.size() == views[0].colours.size());
  REQUIRE(views[0].rays.size() > 50);
  const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, frame);
  const Eigen::Vector3d& on_body = vertices[body.triangles[0][0]];
  const Eigen::Vector3d from = capture.frames[frame].camera.centre();
  const cv::Mat image = capture.image(frame), mask = capture.mask(frame);
  std::array<double, 3> least{255, 255, 255}, most{0, 0, 0};  // of the person
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x)
      for (int c = 0; c < 3 && mask.at<std::uint8_t>(y, x) != 0; ++c) {
        least[c] = std::min<double>(least[c], image.at<cv::Vec3b>(y, x)[c]);
        most[c] = std::max<double>(most[c], image.at<cv::Vec3b>(y, x)[c]);
      }
  for (std::size_t i = 0; i < views[0].rays.size(); ++i) {
    CHECK((views[0].rays[i].origin - on_body).dot(from - on_body) < 0);
    for (int c = 0; c < 3; ++c) {
      CHECK(views[0].colours[i][c] >= least[c]);
      CHECK(views[0].colours[i][c] <= most[c]);
    }
  }
}

TEST_CASE("unseen surface: views keep away from the body's outline") {
  const TemporaryFolder folder;
  synthesise({.output = folder.path(), .frames = 4, .width = 160, .height = 128, .motion = {}});
  const Capture capture = load_capture(folder.path());
  const Body body = body_of(capture);
  const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, 0);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : vertices) centre += vertex / static_cast<double>(vertices.size());
  const Camera behind = orbit(capture.frames[0].camera, centre, up_direction(capture), 180, 180, 1).front();
  const Visibility seen = rasterise(behind, vertices, body.triangles);
  const UnseenView view = unseen_views(body, capture, {0}, 1).front();
  REQUIRE(view.rays.size() > 100);
  for (const Ray& ray : view.rays) {
    const Eigen::Vector3d pixel = behind.project(ray.origin + ray.direction);
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    for (const int row : {y - 1, y, y + 1})
      for (const int column : {x - 1, x, x + 1})
        if (row >= 0 && row < seen.height && column >= 0 && column < seen.width)
          CHECK(seen.triangle[static_cast<std::size_t>(row) * seen.width + column] >= 0);
  }
}

TEST_CASE("unseen surface: a body that all pictures miss is refused") {
  Capture capture = small_capture();
  for (Eigen::Vector3d& translation : capture.human->poses.translation) translation.y() += 100;
  CHECK_THROWS_WITH_AS(surface_colours(body_of(capture), capture, capture.training_frames()),
                       doctest::Contains("no picture shows the body within its mask"), Error);
  CHECK(unseen_views(body_of(capture), capture, capture.training_frames(), 0).empty());
}
