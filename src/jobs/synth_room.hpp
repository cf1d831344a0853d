#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "synth_pattern.hpp"
#include "vivant/data/capture.hpp"

namespace vivant::synth {

struct RoomRay {
  Point origin;
  Point direction;  ///< need not have unit length; distances are in its units
};

/// Where a ray meets the room or a piece of furniture.
struct RoomHit {
  float distance = 0;
  Point position;
  Point normal;
  Point local;  ///< position in the frame of the piece that was hit, its centre at 0
  Point local_normal;
  int piece = -1;  ///< index of the furniture, -1 for the room's shell
};

enum class Material { bookshelf, fabric, crate, pottery, leaves, lamp, ball, wood };

/// A box or an ellipsoid, turned about +y.
struct Furniture {
  Point centre;
  Point half;
  float yaw = 0;  ///< degrees
  Material material = Material::wood;
  Colour colour = Colour::Ones();
  bool ellipsoid = false;
  float cosine = 1, sine = 0;  ///< of yaw
};

/// A furnished room: floor at y = 0, the open middle around the origin, back wall at low z.
class Room {
 public:
  explicit Room(std::uint32_t seed);

  /// The first surface along the ray. The origin must be inside the room, so there always is one.
  RoomHit intersect(const RoomRay& ray) const;
  /// Whether furniture stands between a point and the light.
  bool blocked(const Point& from, const Point& to) const;
  /// The diffuse colour of the surface.
  Colour albedo(const RoomHit& hit) const;
  /// How much of the indirect light reaches the surface: less in corners and beside furniture on the floor.
  float openness(const RoomHit& hit) const;

  /// The inner walls.
  const Box& box() const { return box_; }
  /// Half the side of the square around the origin that holds no furniture.
  double free_half_width() const { return 1.35; }

 private:
  Colour floor(const Point& p) const;
  Colour wall(const RoomHit& hit) const;
  Colour furniture(const Furniture& piece, const RoomHit& hit) const;

  Box box_;
  std::uint32_t seed_;
  std::vector<Furniture> pieces_;
};

}  // namespace vivant::synth
