#include "synth_pattern.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace vivant::synth {

namespace {

/// sRGB 0..1 to linear light, from a table: it is asked for several times a sample.
float linear_light(float value) {
  static const std::array<float, 1025> table = [] {
    std::array<float, 1025> powers;
    for (std::size_t i = 0; i < powers.size(); ++i)
      powers[i] = std::pow(static_cast<float>(i) / 1024.0F, 2.2F);
    return powers;
  }();
  return table[static_cast<std::size_t>(std::clamp(value, 0.0F, 1.0F) * 1024.0F + 0.5F)];
}

}  // namespace

Colour colour_from_srgb(int red, int green, int blue) {
  const float unit = 1.0F / 255.0F;
  return {linear_light(unit * static_cast<float>(red)), linear_light(unit * static_cast<float>(green)),
          linear_light(unit * static_cast<float>(blue))};
}

Colour colour_from_hue(float hue, float saturation, float value) {
  const auto channel = [&](float offset) {
    const float position = 6.0F * (hue + offset - std::floor(hue + offset));
    const float level = std::clamp(std::abs(position - 3.0F) - 1.0F, 0.0F, 1.0F);
    return linear_light(value * (1.0F - saturation * (1.0F - level)));
  };
  return {channel(0.0F), channel(2.0F / 3.0F), channel(1.0F / 3.0F)};
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

float lattice_random(int x, int y, int z, std::uint32_t stream) {
  std::uint32_t h = stream * 0x9E3779B9U + 0x85EBCA6BU;
  for (const int value : {x, y, z}) {
    h = (h ^ static_cast<std::uint32_t>(value)) * 0xC2B2AE35U;
    h ^= h >> 15;
  }
  h = (h * 0x27D4EB2FU) ^ (h >> 13);
  h = (h * 0x165667B1U) ^ (h >> 16);
  return static_cast<float>(h >> 8) / 16777216.0F;
}

float value_noise(const Point& p, std::uint32_t stream) {
  const Point base = p.array().floor();
  const Point t = p - base;
  const Point s = (t.array() * t.array() * (3.0F - 2.0F * t.array())).matrix();
  const int x = static_cast<int>(base.x()), y = static_cast<int>(base.y()), z = static_cast<int>(base.z());
  const auto along_x = [&](int j, int k) {
    return std::lerp(lattice_random(x, y + j, z + k, stream), lattice_random(x + 1, y + j, z + k, stream),
                     s.x());
  };
  const float near = std::lerp(along_x(0, 0), along_x(1, 0), s.y());
  if (s.z() == 0) return 2.0F * near - 1.0F;  // patterns on flat faces
  const float far = std::lerp(along_x(0, 1), along_x(1, 1), s.y());
  return 2.0F * std::lerp(near, far, s.z()) - 1.0F;
}

float cloud_noise(const Point& p, std::uint32_t stream) {
  return 0.57F * value_noise(p, stream) + 0.29F * value_noise(2.03F * p, stream + 1) +
         0.14F * value_noise(4.1F * p, stream + 2);
}

float lines(float x, float period, float width) {
  const float distance = std::abs(x - period * std::round(x / period));
  return 1.0F - smooth_step(0.5F * width, width, distance);
}

}  // namespace vivant::synth
