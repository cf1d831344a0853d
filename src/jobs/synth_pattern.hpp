#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace vivant::synth {

/// Colours are linear RGB, not sRGB, in everything that is shaded.
using Colour = Eigen::Vector3f;
using Point = Eigen::Vector3f;

/// From sRGB 0..255 as painters' tables give it.
Colour colour_from_srgb(int red, int green, int blue);
/// A colour from hue (turns), saturation and value, all in [0,1].
Colour colour_from_hue(float hue, float saturation, float value);

/// 0 below `low`, 1 above `high`, smooth between: edges wide enough not to alias.
float smooth_step(float low, float high, float x);
inline Colour blend(const Colour& a, const Colour& b, float t) { return a + t * (b - a); }

/// A random number in [0,1) that depends on three integers and a stream alone.
float lattice_random(int x, int y, int z, std::uint32_t stream);

/// Value noise in [-1,1] whose features are about one unit wide.
float value_noise(const Point& p, std::uint32_t stream);
/// Three octaves of it.
float cloud_noise(const Point& p, std::uint32_t stream);

/// 1 on lines `width` wide at multiples of `period`, 0 between, with soft edges.
float lines(float x, float period, float width);

}  // namespace vivant::synth
