#include "synth_renderer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace vivant::synth {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

constexpr int kGrid = 3;  // samples along a pixel's side
constexpr int kSamples = kGrid * kGrid;
constexpr int kShadowSize = 1024;

const Point kLamp(-1.7F, 2.6F, 2.3F);
constexpr float kLampRadius = 0.16F;
const Colour kLampLight(1.12F, 1.02F, 0.86F);
const Colour kSkyLight(0.42F, 0.45F, 0.5F);     // indirect light on what faces up
const Colour kGroundLight(0.24F, 0.2F, 0.17F);  // and on what faces down

/// Points in the unit disc, one a sample of a pixel: together they make soft shadows.
std::array<Eigen::Vector2f, kSamples> disc_points() {
  std::array<Eigen::Vector2f, kSamples> points;
  for (int i = 0; i < kSamples; ++i) {
    const float radius = std::sqrt((static_cast<float>(i) + 0.5F) / kSamples);
    const float angle = 2.39996F * static_cast<float>((7 * i) % kSamples);  // the golden angle
    points[i] = radius * Eigen::Vector2f(std::cos(angle), std::sin(angle));
  }
  return points;
}

/// A person at one instant, ready to be shaded.
struct PosedPerson {
  std::vector<Vector3d> vertices;
  std::vector<Vector3d> normals;
  std::vector<Vector3d> contacts;  ///< points of the feet, for the darker floor beneath
  Camera lamp_camera;
  Visibility from_lamp;
};

PosedPerson pose_person(const Body& body, const Pose& pose, const Vector3d& translation) {
  PosedPerson person;
  const auto transforms = joint_transforms(body, pose, translation);
  person.vertices = skin(body, transforms);
  person.normals = vertex_normals(person.vertices, body.triangles);
  const std::vector<Vector3d> joints = posed_joints(body, transforms);
  for (const char* name : {"LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"}) {
    if (const int joint = body.find_joint(name); joint >= 0) person.contacts.push_back(joints[joint]);
  }
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : person.vertices) bounds.extend(vertex);
  const double distance = (bounds.center() - kLamp.cast<double>()).norm();
  Camera& camera = person.lamp_camera;
  camera.width = camera.height = kShadowSize;
  camera.fx = camera.fy = 0.5 * kShadowSize * distance / (0.55 * bounds.diagonal().norm());
  camera.cx = camera.cy = 0.5 * kShadowSize;
  camera.world_to_camera = look_at(kLamp.cast<double>(), bounds.center(), Vector3d::UnitY());
  person.from_lamp = rasterise(camera, person.vertices, body.triangles);
  return person;
}

/// Whether the person stands between the lamp and a point; `spread` (metres at the person) softens the
/// border.
bool shaded_by_person(const PosedPerson& person, const Point& position, const Eigen::Vector2f& jitter,
                      float spread) {
  const Vector3d seen = person.lamp_camera.project(position.cast<double>());
  if (seen.z() <= 0) return false;
  const double texels = person.lamp_camera.fx / seen.z() * spread;
  const int x = static_cast<int>(std::floor(seen.x() + texels * jitter.x()));
  const int y = static_cast<int>(std::floor(seen.y() + texels * jitter.y()));
  if (x < 0 || y < 0 || x >= kShadowSize || y >= kShadowSize) return false;
  const double bias = 0.025 + 1.5 * spread;  // metres
  return person.from_lamp.inverse_depth[static_cast<std::size_t>(y) * kShadowSize + x] >
         1.0 / (seen.z() - bias);
}

Colour lit(const Colour& albedo, const Point& normal, const Point& position, float openness, bool shadow) {
  const Colour indirect = blend(kGroundLight, kSkyLight, 0.5F + 0.5F * normal.y());
  Colour light = openness * indirect;
  if (!shadow) {
    const Point towards = kLamp - position;
    const float fall_off = 1.0F / (0.55F + 0.05F * towards.squaredNorm());
    light += std::max(0.0F, normal.dot(towards.normalized())) * fall_off * kLampLight;
  }
  return albedo.cwiseProduct(light);
}

}  // namespace

cv::Vec3b to_srgb(const Colour& colour) {
  cv::Vec3b out;
  for (int i = 0; i < 3; ++i) {
    const float value = std::clamp(colour[i], 0.0F, 1.0F);
    const float soft =
        value < 0.75F ? value : 0.75F + 0.25F * (1 - std::exp(-(value - 0.75F) / 0.25F)) / 0.63212F;
    out[i] = static_cast<std::uint8_t>(std::lround(255.0F * std::pow(soft, 1.0F / 2.2F)));
  }
  return out;
}

Colour flat_colour(const Room& room, const RoomHit& hit) {
  return lit(room.albedo(hit), hit.normal, hit.position, room.openness(hit), false);
}

namespace {

/// Everything one pixel's samples need.
struct Shader {
  const Room& room;
  const Body& body;
  const Wardrobe& wardrobe;
  const PosedPerson& person;
  std::array<Eigen::Vector2f, kSamples> jitter = disc_points();

  Colour room_colour(const RoomHit& hit, int sample) const {
    float open = room.openness(hit);
    if (hit.position.y() < 0.01F) {
      for (const Vector3d& contact : person.contacts) {
        const float away = std::hypot(hit.position.x() - static_cast<float>(contact.x()),
                                      hit.position.z() - static_cast<float>(contact.z()));
        const float spread = 0.09F + 0.8F * std::max(0.0F, static_cast<float>(contact.y()) - 0.05F);
        open *= 1.0F - 0.03F / spread * std::exp(-away * away / (2 * spread * spread));
      }
    }
    const Eigen::Vector2f& offset = jitter[sample];
    const Point lamp = kLamp + kLampRadius * Point(offset.x(), 0.0F, offset.y());
    const Point outside = hit.position + 0.004F * hit.normal;
    const bool shadow = shaded_by_person(person, hit.position, offset, 0.045F) || room.blocked(outside, lamp);
    return lit(room.albedo(hit), hit.normal, hit.position, open, shadow);
  }

  Colour person_colour(int triangle, const Ray& ray, int sample) const {
    const Vector3i& t = body.triangles[triangle];
    const Vector3d &a = person.vertices[t[0]], &b = person.vertices[t[1]], &c = person.vertices[t[2]];
    const Vector3d normal = (b - a).cross(c - a);
    const double distance = normal.dot(a - ray.origin) / normal.dot(ray.direction);
    const Vector3d hit = ray.origin + distance * ray.direction;
    const double weight_b = (hit - a).cross(c - a).dot(normal) / normal.squaredNorm();
    const double weight_c = (b - a).cross(hit - a).dot(normal) / normal.squaredNorm();
    const Vector3d weights(1 - weight_b - weight_c, weight_b, weight_c);
    const auto mixed = [&](const std::vector<Vector3d>& values) {
      return Vector3d(weights[0] * values[t[0]] + weights[1] * values[t[1]] + weights[2] * values[t[2]]);
    };
    const Point shading_normal = mixed(person.normals).normalized().cast<float>();
    const Point position = hit.cast<float>();
    const bool shadow = shaded_by_person(person, position + 0.01F * shading_normal, jitter[sample], 0.01F);
    return lit(wardrobe.colour(mixed(body.vertices).cast<float>()), shading_normal, position, 1.0F, shadow);
  }
};

}  // namespace

Renderer::Renderer(const Room& room, const Body& body, const Wardrobe& wardrobe)
    : room_(room), body_(body), wardrobe_(wardrobe) {}

Picture Renderer::render(const Camera& camera, const Pose& pose, const Vector3d& translation) const {
  const PosedPerson person = pose_person(body_, pose, translation);
  const Camera fine = camera.resized(camera.width * kGrid, camera.height * kGrid);
  const Visibility visible = rasterise(fine, person.vertices, body_.triangles);
  const Shader shader{room_, body_, wardrobe_, person};
  const Vector3d origin = camera.centre();
  const Eigen::Matrix3d camera_to_world = camera.world_to_camera.topLeftCorner<3, 3>().transpose();

  Picture picture{cv::Mat(camera.height, camera.width, CV_8UC3),
                  cv::Mat(camera.height, camera.width, CV_8UC1)};
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    for (int row = rows.start; row < rows.end; ++row) {
      for (int column = 0; column < camera.width; ++column) {
        Colour total = Colour::Zero();
        int covered = 0;
        for (int sample = 0; sample < kSamples; ++sample) {
          const int x = column * kGrid + sample % kGrid, y = row * kGrid + sample / kGrid;
          const Vector3d pixel((x + 0.5 - fine.cx) / fine.fx, (y + 0.5 - fine.cy) / fine.fy, 1);
          const Ray ray{origin, camera_to_world * pixel};
          const RoomHit hit = room_.intersect({ray.origin.cast<float>(), ray.direction.cast<float>()});
          const std::size_t at = static_cast<std::size_t>(y) * fine.width + x;
          // The direction is one metre long along the optical axis: the distance is the depth.
          if (visible.triangle[at] >= 0 && visible.inverse_depth[at] * hit.distance > 1) {
            total += shader.person_colour(visible.triangle[at], ray, sample).cwiseMin(1.0F);
            ++covered;
          } else {
            total += shader.room_colour(hit, sample).cwiseMin(1.0F);
          }
        }
        picture.image.at<cv::Vec3b>(row, column) = to_srgb(total / kSamples);
        picture.mask.at<std::uint8_t>(row, column) = 2 * covered >= kSamples ? 255 : 0;
      }
    }
  });
  return picture;
}

}  // namespace vivant::synth
