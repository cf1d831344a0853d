#include "vivant/model/unseen_surface.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "vivant/data/camera_path.hpp"
#include "vivant/data/rasterise.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

constexpr double least_facing = 0.3;  // cosine between normal and view: 73 degrees
constexpr int nearest_count = 4;

/// A mask without the pixels that are at most so many image heights from its outline.
cv::Mat inner(const cv::Mat& mask, double heights) {
  const int size = 2 * static_cast<int>(std::lround(heights * mask.rows)) + 1;
  cv::Mat inside;
  cv::erode(mask, inside, cv::Mat::ones(size, size, CV_8U));
  return inside;
}

cv::Mat silhouette(const Visibility& seen) {
  return cv::Mat(seen.height, seen.width, CV_32SC1, const_cast<int*>(seen.triangle.data())) >= 0;
}

/// Sums of colours and their weights, and which vertices any picture shows.
struct Observed {
  std::vector<cv::Vec3f> sum;
  std::vector<float> weight;
  std::vector<bool> visible;
};

void observe(const Body& body, const Capture& capture, int frame, double error, Observed& observed) {
  const std::vector<Vector3d> vertices =
      posed_vertices(body, capture.human->poses, capture.frames[frame].body_frame);
  const std::vector<Vector3d> normals = vertex_normals(vertices, body.triangles);
  const Camera& camera = capture.frames[frame].camera;
  const Visibility seen = rasterise(camera, vertices, body.triangles);
  const cv::Mat image = capture.image(frame), inside = inner(capture.mask(frame), error);
  const Vector3d eye = camera.centre();
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x) {
      const int triangle = seen.triangle[static_cast<std::size_t>(y) * seen.width + x];
      if (triangle < 0) continue;
      for (const int v : body.triangles[triangle]) {
        observed.visible[v] = true;
        const auto facing = static_cast<float>(normals[v].dot((eye - vertices[v]).normalized()));
        if (facing < least_facing || inside.at<std::uint8_t>(y, x) == 0) continue;
        observed.sum[v] += facing * cv::Vec3f(image.at<cv::Vec3b>(y, x));
        observed.weight[v] += facing;
      }
    }
}

/// The mean of the nearest vertices that have a colour.
cv::Vec3f nearest_colour(const Body& body, const std::vector<int>& known,
                         const std::vector<cv::Vec3f>& colour, int vertex) {
  std::vector<std::pair<double, int>> by_distance;
  by_distance.reserve(known.size());
  for (const int v : known)
    by_distance.emplace_back((body.vertices[v] - body.vertices[vertex]).squaredNorm(), v);
  const auto count = std::min<std::size_t>(nearest_count, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count),
                    by_distance.end());
  cv::Vec3f sum(0, 0, 0);
  for (std::size_t i = 0; i < count; ++i) sum += colour[by_distance[i].second];
  return sum / static_cast<float>(count);
}

UnseenView view_of(const Body& body, const Capture& capture, const std::vector<int>& frames, std::size_t row,
                   double turn, double error, const SurfaceColours& surface) {
  const int frame = frames[row];
  const std::vector<Vector3d> vertices =
      posed_vertices(body, capture.human->poses, capture.frames[frame].body_frame);
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& vertex : vertices) centre += vertex / static_cast<double>(vertices.size());
  const Camera camera =
      orbit(capture.frames[frame].camera, centre, up_direction(capture), turn, turn, 1).front();
  const Visibility seen = rasterise(camera, vertices, body.triangles);
  const cv::Mat within = inner(silhouette(seen), 2 * error);
  UnseenView view{row, {}, {}};
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x) {
      const int triangle = seen.triangle[static_cast<std::size_t>(y) * seen.width + x];
      if (within.at<std::uint8_t>(y, x) == 0) continue;
      const Eigen::Vector3i& corners = body.triangles[triangle];
      if (std::any_of(corners.begin(), corners.end(), [&](int v) { return !surface.unseen[v]; })) continue;
      cv::Vec3f colour(0, 0, 0);
      for (const int v : corners) colour += surface.colour[v] / 3;
      view.rays.push_back(camera.ray({x + 0.5, y + 0.5}));
      view.colours.emplace_back(colour);
    }
  return view;
}

}  // namespace

std::optional<SurfaceColours> surface_colours(const Body& body, const Capture& capture,
                                              const std::vector<int>& frames, double error) {
  const std::size_t count = body.vertices.size();
  Observed observed{std::vector<cv::Vec3f>(count), std::vector<float>(count), std::vector<bool>(count)};
  for (const int frame : frames) observe(body, capture, frame, error, observed);
  SurfaceColours surface{std::vector<cv::Vec3f>(count), std::vector<bool>(count)};
  std::vector<int> known;
  for (std::size_t v = 0; v < count; ++v) {
    if (observed.weight[v] > 0) known.push_back(static_cast<int>(v));
    surface.unseen[v] = !observed.visible[v];
    if (observed.weight[v] > 0) surface.colour[v] = observed.sum[v] / observed.weight[v];
  }
  if (known.empty()) return std::nullopt;
  for (std::size_t v = 0; v < count; ++v)
    if (observed.weight[v] == 0)
      surface.colour[v] = nearest_colour(body, known, surface.colour, static_cast<int>(v));
  return surface;
}

std::vector<UnseenView> unseen_views(const Body& body, const Capture& capture, const std::vector<int>& frames,
                                     int count, double error) {
  std::vector<UnseenView> views;
  if (count == 0) return views;
  const std::optional<SurfaceColours> surface = surface_colours(body, capture, frames, error);
  if (!surface) return views;
  for (int i = 0; i < count; ++i) {
    const std::size_t row = i * frames.size() / count;
    const double turn = 360.0 * (i + 1) / (count + 1);
    views.push_back(view_of(body, capture, frames, row, turn, error, *surface));
  }
  return views;
}

}  // namespace vivant
