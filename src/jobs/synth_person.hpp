#pragma once
#include <cstdint>

#include "synth_pattern.hpp"
#include "vivant/data/body.hpp"

namespace vivant::synth {

/// The body with hair, loose clothes and shoes: its surface smoothed and moved outwards at rest. Same
/// topology, rig and texture coordinates, so it is the exact body of the pictures made with it. Made for
/// assets/body.safetensors.
Body dressed(const Body& body);

/// Colours of skin, hair and clothes by the place on the resting body.
class Wardrobe {
 public:
  explicit Wardrobe(std::uint32_t seed);
  /// `rest` is a point on the dressed body at rest.
  Colour colour(const Point& rest) const;

 private:
  Colour shirt(const Point& p) const;
  Colour trousers(const Point& p) const;
  Colour shoe(const Point& p) const;
  Colour head(const Point& p) const;
  Colour face(const Point& p, Colour skin) const;

  std::uint32_t seed_;
  Colour skin_, hair_, shirt_, stripe_, trousers_, shoe_, iris_;
};

}  // namespace vivant::synth
