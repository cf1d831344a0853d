#include "vivant/model/unseen_surface.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "small_capture.hpp"
#include "vivant/data/camera_path.hpp"
#include "vivant/data/rasterise.hpp"
#include "vivant/io/image.hpp"

using namespace vivant;

namespace {

Body body_of(const Capture& capture) { return shaped(capture.human->body, capture.human->poses.shape); }

std::vector<Eigen::Vector3d> posed_in(const Body& body, const Capture& capture, int frame) {
  return posed_vertices(body, capture.human->poses, capture.frames[frame].body_frame);
}

Camera turned(const Body& body, const Capture& capture, int frame, double degrees) {
  const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, frame);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : vertices) centre += vertex / static_cast<double>(vertices.size());
  return orbit(capture.frames[frame].camera, centre, up_direction(capture), degrees, degrees, 1).front();
}

int triangle_at(const Visibility& seen, int x, int y) {
  return seen.triangle[static_cast<std::size_t>(y) * seen.width + x];
}

/// The vertices that a picture shows from no flat angle, within the mask.
std::vector<bool> shown_within_masks(const Body& body, const Capture& capture,
                                     const std::vector<int>& frames) {
  std::vector<bool> shown(body.vertices.size());
  for (const int frame : frames) {
    const Camera& camera = capture.frames[frame].camera;
    const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, frame),
                                       normals = vertex_normals(vertices, body.triangles);
    const Visibility seen = rasterise(camera, vertices, body.triangles);
    const cv::Mat mask = capture.mask(frame);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x)
        if (triangle_at(seen, x, y) >= 0 && mask.at<std::uint8_t>(y, x) != 0)
          for (const int v : body.triangles[triangle_at(seen, x, y)])
            if (normals[v].dot((camera.centre() - vertices[v]).normalized()) > 0.3) shown[v] = true;
  }
  return shown;
}

}  // namespace

TEST_CASE("unseen surface: what pictures show has their colours") {
  const Capture& capture = small_capture();
  const Body body = body_of(capture);
  const std::vector<int> frames = capture.training_frames();
  const SurfaceColours surface = surface_colours(body, capture, frames, 0).value();
  double difference = 0, of_mean = 0, count = 0;
  for (const int frame : frames) {
    const Camera& camera = capture.frames[frame].camera;
    const std::vector<Eigen::Vector3d> vertices = posed_in(body, capture, frame);
    const Visibility seen = rasterise(camera, vertices, body.triangles);
    const cv::Mat image = capture.image(frame), mask = capture.mask(frame);
    const cv::Scalar mean = cv::mean(image, mask);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x) {
        const int triangle = triangle_at(seen, x, y);
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
  const std::vector<UnseenView> views = unseen_views(body, capture, {frame}, 1, 0);
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
  const Camera behind = turned(body, capture, 0, 180);
  const Visibility seen = rasterise(behind, posed_in(body, capture, 0), body.triangles);
  const UnseenView view = unseen_views(body, capture, {0}, 1, 0.004).front();
  REQUIRE(view.rays.size() > 100);
  for (const Ray& ray : view.rays) {
    const Eigen::Vector3d pixel = behind.project(ray.origin + ray.direction);
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    for (const int row : {y - 1, y, y + 1})
      for (const int column : {x - 1, x, x + 1})
        if (row >= 0 && row < seen.height && column >= 0 && column < seen.width)
          CHECK(triangle_at(seen, column, row) >= 0);
  }
}

TEST_CASE("unseen surface: other vertices have the mean colour of the nearest four") {
  const Capture& capture = small_capture();
  const Body body = body_of(capture);
  const std::vector<int> frames = {capture.training_frames().front()};
  const SurfaceColours surface = surface_colours(body, capture, frames, 0).value();
  const std::vector<bool> shown = shown_within_masks(body, capture, frames);
  int checked = 0;
  for (std::size_t v = 0; v < shown.size(); v += 7) {
    if (shown[v]) continue;
    std::vector<std::pair<double, std::size_t>> others;
    for (std::size_t u = 0; u < shown.size(); ++u)
      if (shown[u]) others.emplace_back((body.vertices[u] - body.vertices[v]).norm(), u);
    std::sort(others.begin(), others.end());
    cv::Vec3f mean(0, 0, 0);
    for (int i = 0; i < 4; ++i) mean += surface.colour[others[i].second] / 4;
    CHECK(cv::norm(mean - surface.colour[v]) < 0.01);
    ++checked;
  }
  CHECK(checked > 100);
}

TEST_CASE(
    "unseen surface: views go around, of evenly chosen frames, and show what training pictures do not") {
  Capture capture = small_capture();
  for (const int frame : capture.held_out_frames()) capture.frames[frame].image_path = "held-out.png";
  const Body body = body_of(capture);
  const std::vector<int> frames = capture.training_frames();
  const SurfaceColours surface = surface_colours(body, capture, frames, 0).value();
  const std::vector<UnseenView> views = unseen_views(body, capture, frames, 3, 0);
  REQUIRE(views.size() == 3);
  std::size_t rays = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(views[i].row == i * frames.size() / 3);
    const int frame = frames[views[i].row];
    const Camera camera = turned(body, capture, frame, 90.0 * static_cast<double>(i + 1));
    const Visibility seen = rasterise(camera, posed_in(body, capture, frame), body.triangles);
    for (const Ray& ray : views[i].rays) {
      CHECK((ray.origin - camera.centre()).norm() < 1e-6);
      const Eigen::Vector3d pixel = camera.project(ray.origin + ray.direction);
      const int triangle = triangle_at(seen, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      REQUIRE(triangle >= 0);
      for (const int v : body.triangles[triangle]) CHECK(surface.unseen[v]);
      ++rays;
    }
  }
  CHECK(rays > 50);
}

TEST_CASE("unseen surface: without a body within the masks there are no colours and no views") {
  Capture capture = small_capture();
  const Body body = body_of(capture);
  const std::vector<int> frames = capture.training_frames();
  CHECK(unseen_views(body, capture, frames, 0, 0).empty());
  const TemporaryFolder folder;
  write_image(folder / "none.png", cv::Mat(48, 64, CV_8UC1, cv::Scalar(0)));
  for (CaptureFrame& frame : capture.frames) frame.mask_path = folder / "none.png";
  CHECK_FALSE(surface_colours(body, capture, frames, 0));
  CHECK(unseen_views(body, capture, frames, 3, 0).empty());
}
