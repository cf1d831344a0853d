#include "synth_person.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace vivant::synth {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

// Places on the resting body, in metres: y up, facing +z, left is +x, arms at 45 degrees.
constexpr float kShoeTop = 0.1F;
constexpr float kWaist = 0.95F;
constexpr float kNeckline = 1.385F;
constexpr float kArmStart = 0.19F;    // |x| from which a point above the hips belongs to an arm
constexpr float kSleeveEnd = 0.315F;  // |x| along the arm
constexpr float kEdge = 0.004F;

bool on_arm(const Point& p) { return std::abs(p.x()) > kArmStart && p.y() > 0.86F; }

/// Above 0 where hair grows: behind a line from the forehead over the temples and ears to the nape.
float hairiness(const Point& p) {
  const float z = p.z();
  float line = 1.452F;
  line += 0.105F * smooth_step(-0.01F, 0.035F, z);              // behind the ears
  line += 0.03F * smooth_step(0.045F, 0.085F, z);               // temples
  line += 0.04F * smooth_step(0.085F, 0.118F, z);               // forehead
  if (std::abs(p.x()) > 0.074F) line = std::max(line, 1.578F);  // ears stay free
  return p.y() - line;
}

/// Metres by which hair, cloth or leather lies outside the skin.
double thickness(const Point& p) {
  if (p.y() > 1.42F) return 0.014 * smooth_step(0.0F, 0.03F, hairiness(p));
  if (on_arm(p)) return 0.008 * (1 - smooth_step(kSleeveEnd - 0.02F, kSleeveEnd + 0.01F, std::abs(p.x())));
  if (p.y() < kShoeTop) return 0.006;
  if (p.y() < kWaist) return 0.007 + 0.009 * (1 - smooth_step(0.12F, 0.5F, p.y()));
  return 0.009 * (1 - smooth_step(1.34F, 1.41F, p.y()));
}

/// Rounds of smoothing: toes disappear in the shoes, the skin's detail under cloth.
int smoothing_rounds(const Point& p) {
  if (p.y() < 0.06F) return p.z() > 0.1F ? 140 : 20;
  if (p.y() < kShoeTop || on_arm(p) || p.y() > 1.36F) return 0;
  return p.y() > 1.0F ? 14 : 6;
}

std::vector<std::vector<int>> neighbours(const Body& body) {
  std::vector<std::vector<int>> result(body.vertices.size());
  for (const Vector3i& t : body.triangles) {
    for (int i = 0; i < 3; ++i) result[t[i]].insert(result[t[i]].end(), {t[(i + 1) % 3], t[(i + 2) % 3]});
  }
  for (std::vector<int>& list : result) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return result;
}

}  // namespace

Body dressed(const Body& body) {
  Body out = body;
  const auto around = neighbours(body);
  std::vector<int> rounds;
  for (const Vector3d& vertex : body.vertices) rounds.push_back(smoothing_rounds(vertex.cast<float>()));
  const int most = *std::max_element(rounds.begin(), rounds.end());
  for (int round = 0; round < most; ++round) {
    const std::vector<Vector3d> before = out.vertices;
    for (std::size_t v = 0; v < before.size(); ++v) {
      if (rounds[v] <= round) continue;
      Vector3d mean = Vector3d::Zero();
      for (int other : around[v]) mean += before[other];
      out.vertices[v] = 0.5 * (before[v] + mean / static_cast<double>(around[v].size()));
    }
  }
  const std::vector<Vector3d> normals = vertex_normals(out.vertices, out.triangles);
  for (std::size_t v = 0; v < out.vertices.size(); ++v) {
    out.vertices[v] += thickness(body.vertices[v].cast<float>()) * normals[v];
  }
  return out;
}

Wardrobe::Wardrobe(std::uint32_t seed) : seed_(seed) {
  const float hue = lattice_random(5, 0, 0, seed);
  skin_ =
      blend(colour_from_srgb(232, 182, 148), colour_from_srgb(150, 98, 70), lattice_random(6, 0, 0, seed));
  hair_ = blend(colour_from_srgb(44, 28, 20), colour_from_srgb(120, 70, 34), lattice_random(7, 0, 0, seed));
  shirt_ = colour_from_hue(0.09F + 0.06F * hue, 0.82F, 0.95F);
  stripe_ = colour_from_hue(0.56F + 0.1F * hue, 0.75F, 0.42F);
  trousers_ = colour_from_hue(0.6F + 0.05F * hue, 0.55F, 0.5F);
  shoe_ = colour_from_srgb(206, 52, 44);
  iris_ = colour_from_srgb(58, 92, 120);
}

Colour Wardrobe::colour(const Point& p) const {
  if (on_arm(p)) {
    const float along = std::abs(p.x());
    const Colour bare = skin_ * (1.0F + 0.05F * cloud_noise(40.0F * p, seed_));
    return blend(shirt(p), bare, smooth_step(-kEdge, kEdge, along - kSleeveEnd));
  }
  if (p.y() > kNeckline + 0.02F) return head(p);
  if (p.y() > kWaist) {
    const float neckline = kNeckline - 0.05F * smooth_step(0.02F, 0.09F, p.z()) *
                                           (1.0F - smooth_step(0.02F, 0.09F, std::abs(p.x())));
    const float above = p.y() - neckline;
    const float collar = 1.0F - smooth_step(0.008F, 0.012F, std::abs(above + 0.008F));
    return blend(blend(shirt(p), skin_, smooth_step(-kEdge, kEdge, above)), stripe_, collar);
  }
  if (p.y() > kShoeTop) return trousers(p);
  return shoe(p);
}

Colour Wardrobe::shirt(const Point& p) const {
  // Hoops over the trunk, along the sleeve on the arms; a star on the chest; a number on the back.
  const float along = on_arm(p) ? std::abs(p.x()) : p.y();
  Colour colour = blend(shirt_, stripe_, lines(along - 0.02F, on_arm(p) ? 0.055F : 0.085F, 0.022F));
  if (!on_arm(p) && p.y() > 1.11F && p.y() < 1.32F) {
    const float u = p.x(), v = p.y() - 1.21F;
    const float radius = std::hypot(u, v);
    const Colour white = colour_from_srgb(246, 240, 226);
    if (p.z() > 0.03F) {
      const float turn = 5.0F * std::atan2(u, v) / (2.0F * std::numbers::pi_v<float>);
      const float star = 0.026F + 0.09F * std::abs(turn - std::floor(turn) - 0.5F);  // five points
      colour = blend(colour, stripe_, 1.0F - smooth_step(0.084F, 0.088F, radius));
      colour = blend(colour, white, 1.0F - smooth_step(-kEdge, kEdge, radius - star));
    } else {
      const float bar = std::abs(std::abs(u) - 0.035F);  // "11"
      colour =
          blend(colour, white,
                (1.0F - smooth_step(0.013F, 0.017F, bar)) * (1.0F - smooth_step(0.07F, 0.075F, std::abs(v))));
    }
  }
  return colour * (1.0F + 0.12F * cloud_noise(16.0F * p, seed_ + 1));
}

Colour Wardrobe::trousers(const Point& p) const {
  const float leg_axis = 0.188F - 0.1F * p.y();
  const float side =
      0.018F - std::abs(p.z() - 0.022F - 0.03F * p.y());  // inside a stripe down the outer seam;
  Colour colour =
      trousers_ * (1.0F + 0.22F * cloud_noise({60.0F * p.x(), 12.0F * p.y(), 60.0F * p.z()}, seed_ + 2));
  const float angle = std::atan2(p.z() - 0.03F, std::abs(p.x()) - 0.13F);
  const float check = 0.5F * lines(p.y(), 0.09F, 0.012F) + 0.4F * lines(angle, 0.7854F, 0.1F);
  colour = blend(colour, 2.6F * trousers_, 0.55F * check);
  colour = blend(colour, colour_from_srgb(240, 232, 210),
                 smooth_step(-kEdge, kEdge, side) * smooth_step(0.02F, 0.03F, std::abs(p.x()) - leg_axis));
  const Colour belt =
      blend(colour_from_srgb(72, 44, 28), colour_from_srgb(230, 190, 90),
            (1.0F - smooth_step(0.02F, 0.026F, std::abs(p.x()))) * smooth_step(0.04F, 0.06F, p.z()));
  colour = blend(colour, belt, smooth_step(-kEdge, kEdge, p.y() - kWaist + 0.04F));
  return blend(0.6F * trousers_, colour, smooth_step(0.115F, 0.125F, p.y()));
}

Colour Wardrobe::shoe(const Point& p) const {
  const Colour white = colour_from_srgb(242, 238, 230);
  const float across = std::abs(p.x()) - 0.19F;
  const float laces = lines(p.z() - 0.01F, 0.03F, 0.012F) *
                      (1.0F - smooth_step(0.022F, 0.03F, std::abs(across))) *
                      smooth_step(0.05F, 0.07F, p.z()) * (1.0F - smooth_step(0.14F, 0.15F, p.z()));
  Colour colour = blend(shoe_, white, laces);
  colour = blend(colour, white, 1.0F - smooth_step(0.013F, 0.018F, p.y()));
  return blend(colour, colour_from_srgb(60, 54, 52), 1.0F - smooth_step(0.002F, 0.006F, p.y()));
}

Colour Wardrobe::head(const Point& p) const {
  const Colour skin = skin_ * (1.0F + 0.04F * cloud_noise(50.0F * p, seed_ + 3));
  const float strands = cloud_noise({90.0F * p.x(), 25.0F * p.y(), 45.0F * p.z()}, seed_ + 4);
  return blend(face(p, skin), hair_ * (1.0F + 0.5F * strands), smooth_step(-0.003F, 0.003F, hairiness(p)));
}

Colour Wardrobe::face(const Point& p, Colour skin) const {
  if (p.z() < 0.09F || p.y() < 1.43F) return skin;
  const float x = std::abs(p.x());
  const auto spot = [&](float u, float v, float radius_u, float radius_v) {  // 1 inside an ellipse
    return 1.0F - smooth_step(0.85F, 1.15F, std::hypot((x - u) / radius_u, (p.y() - v) / radius_v));
  };
  skin = blend(skin, skin.cwiseProduct(Colour(1.15F, 0.72F, 0.66F)),
               0.5F * spot(0.045F, 1.515F, 0.02F, 0.016F));  // cheeks
  skin = blend(skin, skin.cwiseProduct(Colour(0.72F, 0.26F, 0.26F)),
               spot(0.0F, 1.4945F, 0.025F, 0.0095F));  // lips
  const float brow = 1.574F + 0.1F * (0.03F - x) * (x - 0.03F) * 20.0F;
  skin = blend(skin, hair_, 0.9F * spot(0.03F, brow, 0.021F, 0.0048F));
  skin = blend(skin, 0.3F * hair_, spot(0.029F, 1.5555F, 0.0185F, 0.0102F));  // lashes
  skin = blend(skin, colour_from_srgb(240, 238, 234), spot(0.029F, 1.5538F, 0.016F, 0.0078F));
  skin = blend(skin, iris_, spot(0.0285F, 1.5538F, 0.0075F, 0.0078F));
  return blend(skin, colour_from_srgb(16, 14, 14), spot(0.0285F, 1.5538F, 0.0035F, 0.0035F));
}

}  // namespace vivant::synth
