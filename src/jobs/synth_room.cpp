#include "synth_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace vivant::synth {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Point into_piece(const Furniture& piece, const Point& p) {
  return {piece.cosine * p.x() - piece.sine * p.z(), p.y(), piece.cosine * p.z() + piece.sine * p.x()};
}

Point out_of_piece(const Furniture& piece, const Point& p) {
  return {piece.cosine * p.x() + piece.sine * p.z(), p.y(), piece.cosine * p.z() - piece.sine * p.x()};
}

/// Whether the ray passes within the piece's bounding sphere.
bool near_piece(const Furniture& piece, const RoomRay& ray) {
  const Point towards = piece.centre - ray.origin;
  const float along = towards.dot(ray.direction), length = ray.direction.squaredNorm();
  return towards.squaredNorm() * length - along * along < piece.half.squaredNorm() * length;
}

/// Distance to the box |x| <= half from outside; infinity when it is missed. `normal` is set on a hit.
float enter_box(const Point& origin, const Point& direction, const Point& half, Point* normal) {
  float enter = -kInfinity, leave = kInfinity;
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    const float inverse = 1.0F / direction[i];
    float near = (-half[i] - origin[i]) * inverse, far = (half[i] - origin[i]) * inverse;
    if (near > far) std::swap(near, far);
    if (near > enter) enter = near, axis = i;
    leave = std::min(leave, far);
  }
  if (enter > leave || enter <= 0) return kInfinity;
  *normal = Point::Zero();
  (*normal)[axis] = direction[axis] > 0 ? -1.0F : 1.0F;
  return enter;
}

float enter_ellipsoid(const Point& origin, const Point& direction, const Point& half, Point* normal) {
  const Point o = origin.cwiseQuotient(half), d = direction.cwiseQuotient(half);
  const float a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - 1;
  const float discriminant = b * b - a * c;
  if (discriminant < 0) return kInfinity;
  const float distance = (-b - std::sqrt(discriminant)) / a;
  if (distance <= 0) return kInfinity;
  *normal = (o + distance * d).cwiseQuotient(half).normalized();
  return distance;
}

float enter(const Furniture& piece, const RoomRay& ray, RoomHit* hit) {
  if (!near_piece(piece, ray)) return kInfinity;
  const Point origin = into_piece(piece, ray.origin - piece.centre);
  const Point direction = into_piece(piece, ray.direction);
  const float distance = piece.ellipsoid ? enter_ellipsoid(origin, direction, piece.half, &hit->local_normal)
                                         : enter_box(origin, direction, piece.half, &hit->local_normal);
  if (distance < kInfinity) {
    hit->local = origin + distance * direction;
    hit->normal = out_of_piece(piece, hit->local_normal);
  }
  return distance;
}

std::vector<Furniture> furnish(std::uint32_t seed) {
  const float hue = lattice_random(1, 0, 0, seed);
  const Colour sofa = colour_from_hue(0.38F + 0.14F * hue, 0.5F, 0.5F);
  const Colour cushion = colour_from_hue(0.03F + 0.08F * hue, 0.72F, 0.9F);
  const Colour wood = colour_from_srgb(150, 104, 66);
  const Colour clay = colour_from_srgb(190, 98, 62);
  const Colour green = colour_from_srgb(74, 122, 52);
  return {
      {{-2.0F, 1.0F, -2.42F}, {0.62F, 1.0F, 0.17F}, 0, Material::bookshelf, wood},
      // Sofa: seat, back, arms, cushions.
      {{1.15F, 0.2F, -2.0F}, {0.8F, 0.2F, 0.42F}, 0, Material::fabric, sofa},
      {{1.15F, 0.55F, -2.38F}, {0.8F, 0.3F, 0.12F}, 0, Material::fabric, sofa},
      {{0.24F, 0.32F, -2.0F}, {0.11F, 0.32F, 0.45F}, 0, Material::fabric, sofa},
      {{2.06F, 0.32F, -2.0F}, {0.11F, 0.32F, 0.45F}, 0, Material::fabric, sofa},
      {{0.62F, 0.56F, -2.12F}, {0.19F, 0.19F, 0.09F}, 12, Material::fabric, cushion},
      {{1.66F, 0.56F, -2.12F}, {0.19F, 0.19F, 0.09F}, -14, Material::fabric, cushion},
      // Crates.
      {{-2.15F, 0.24F, -0.95F}, {0.3F, 0.24F, 0.24F}, 24, Material::crate, colour_from_srgb(196, 150, 92)},
      {{-2.1F, 0.6F, -0.98F}, {0.17F, 0.13F, 0.16F}, -18, Material::crate, colour_from_srgb(86, 128, 140)},
      // Plant.
      {{-0.72F, 0.19F, -2.25F}, {0.17F, 0.19F, 0.17F}, 45, Material::pottery, clay},
      {{-0.72F, 0.82F, -2.22F}, {0.3F, 0.42F, 0.28F}, 0, Material::leaves, green, true},
      {{-0.58F, 1.22F, -2.26F}, {0.18F, 0.26F, 0.18F}, 0, Material::leaves, green, true},
      {{-0.92F, 1.08F, -2.2F}, {0.17F, 0.24F, 0.16F}, 0, Material::leaves, green, true},
      // Side table with a lamp, and a ball.
      {{2.5F, 0.3F, -1.05F}, {0.24F, 0.3F, 0.24F}, 8, Material::wood, wood},
      {{2.5F, 0.7F, -1.05F}, {0.05F, 0.12F, 0.05F}, 8, Material::pottery, clay},
      {{2.5F, 0.96F, -1.05F},
       {0.19F, 0.17F, 0.19F},
       0,
       Material::lamp,
       colour_from_srgb(255, 226, 170),
       true},
      {{1.62F, 0.17F, -0.95F},
       {0.17F, 0.17F, 0.17F},
       30,
       Material::ball,
       colour_from_srgb(224, 62, 48),
       true},
  };
}

}  // namespace

Room::Room(std::uint32_t seed)
    : box_{{-3.0, 0.0, -2.6}, {3.0, 2.8, 4.0}}, seed_(seed), pieces_(furnish(seed)) {
  for (Furniture& piece : pieces_) {
    const float angle = piece.yaw * std::numbers::pi_v<float> / 180;
    piece.cosine = std::cos(angle);
    piece.sine = std::sin(angle);
  }
}

RoomHit Room::intersect(const RoomRay& ray) const {
  RoomHit hit;
  hit.distance = kInfinity;
  for (int i = 0; i < 3; ++i) {  // the shell, from inside
    if (ray.direction[i] == 0) continue;
    const double plane = ray.direction[i] > 0 ? box_.max[i] : box_.min[i];
    const float distance = (static_cast<float>(plane) - ray.origin[i]) / ray.direction[i];
    if (distance < hit.distance) {
      hit.distance = distance;
      hit.normal = Point::Zero();
      hit.normal[i] = ray.direction[i] > 0 ? -1.0F : 1.0F;
    }
  }
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    RoomHit candidate;
    const float distance = enter(pieces_[p], ray, &candidate);
    if (distance < hit.distance) {
      hit = candidate;
      hit.distance = distance;
      hit.piece = static_cast<int>(p);
    }
  }
  hit.position = ray.origin + hit.distance * ray.direction;
  return hit;
}

bool Room::blocked(const Point& from, const Point& to) const {
  const RoomRay ray{from, to - from};
  return std::any_of(pieces_.begin(), pieces_.end(), [&](const Furniture& piece) {
    RoomHit hit;
    return piece.material != Material::lamp && enter(piece, ray, &hit) < 1.0F;
  });
}

float Room::openness(const RoomHit& hit) const {
  float open = 1.0F;
  const Point lower = box_.min.cast<float>(), upper = box_.max.cast<float>();
  for (int i = 0; i < 3; ++i) {
    if (std::abs(hit.normal[i]) > 0.5F && hit.piece < 0) continue;  // the wall it lies on
    const float distance = std::min(hit.position[i] - lower[i], upper[i] - hit.position[i]);
    open *= 1.0F - 0.35F * std::exp(-std::max(distance, 0.0F) / 0.22F);
  }
  if (hit.piece >= 0 || hit.position.y() > 0.01F) return open;
  for (const Furniture& piece : pieces_) {
    if (piece.centre.y() - piece.half.y() > 0.05F) continue;
    if ((hit.position - piece.centre).squaredNorm() > 4.0F) continue;
    const Point local = into_piece(piece, hit.position - piece.centre).cwiseAbs() - piece.half;
    const float outside = std::hypot(std::max(local.x(), 0.0F), std::max(local.z(), 0.0F));
    open *= 1.0F - 0.45F * std::exp(-outside / 0.1F);
  }
  return open;
}

Colour Room::albedo(const RoomHit& hit) const {
  if (hit.piece >= 0) return furniture(pieces_[hit.piece], hit);
  return hit.normal.y() > 0.5F ? floor(hit.position) : wall(hit);
}

}  // namespace vivant::synth
