// The room's textures: floor, walls and furniture.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth_room.hpp"

namespace vivant::synth {

namespace {

constexpr float kEdge = 0.008F;  // metres over which one colour turns into the next

/// 1 inside the rectangle |x| < half_width, |y| < half_height, with soft edges.
float rectangle(float x, float y, float half_width, float half_height) {
  return smooth_step(-kEdge, kEdge, half_width - std::abs(x)) *
         smooth_step(-kEdge, kEdge, half_height - std::abs(y));
}

/// Boards along x: `across` is measured over them.
Colour boards(float along, float across, float width, float length, const Colour& wood,
              std::uint32_t stream) {
  const int row = static_cast<int>(std::floor(across / width));
  const float shifted = along + length * lattice_random(row, 0, 0, stream);
  const int board = static_cast<int>(std::floor(shifted / length));
  const float tone = 0.72F + 0.5F * lattice_random(row, board, 1, stream);
  const float grain =
      cloud_noise({1.6F * shifted, 22.0F * across, static_cast<float>(7 * row + board)}, stream);
  const float seam = std::max(lines(across, width, 0.007F), lines(shifted, length, 0.007F));
  return wood * (tone * (1.0F + 0.3F * grain) * (1.0F - 0.6F * seam));
}

Colour bricks(float x, float y, std::uint32_t stream) {
  const float width = 0.26F, height = 0.09F, mortar = 0.012F;
  const int row = static_cast<int>(std::floor(y / height));
  const float shifted = x + (row % 2 != 0 ? 0.5F * width : 0.0F);
  const int column = static_cast<int>(std::floor(shifted / width));
  const float tone = 0.62F + 0.6F * lattice_random(row, column, 0, stream);
  const float pale = lattice_random(row, column, 1, stream);
  Colour brick = blend(colour_from_srgb(168, 84, 62), colour_from_srgb(206, 142, 110), pale * pale);
  brick *= tone * (1.0F + 0.25F * cloud_noise({14.0F * x, 14.0F * y, 0.0F}, stream));
  const float joint = std::max(lines(shifted, width, mortar), lines(y, height, mortar));
  return blend(brick, colour_from_srgb(188, 178, 164), 0.9F * joint);
}

/// An abstract picture on [-1,1]^2: overlapping discs and bars on a wash of two colours.
Colour abstract_picture(float x, float y, std::uint32_t stream) {
  const float hue = lattice_random(0, 0, 0, stream);
  Colour colour = blend(colour_from_hue(hue, 0.35F, 0.92F), colour_from_hue(hue + 0.12F, 0.6F, 0.6F),
                        0.5F + 0.5F * cloud_noise({1.3F * x, 1.3F * y, 0.0F}, stream));
  for (int i = 0; i < 5; ++i) {
    const float u = 1.6F * lattice_random(i, 1, 0, stream) - 0.8F,
                v = 1.6F * lattice_random(i, 2, 0, stream) - 0.8F;
    const float size = 0.18F + 0.35F * lattice_random(i, 3, 0, stream);
    const Colour paint = colour_from_hue(hue + 0.2F + 0.6F * lattice_random(i, 4, 0, stream), 0.75F,
                                         0.35F + 0.6F * lattice_random(i, 5, 0, stream));
    const bool disc = i % 2 == 0;
    const float inside =
        disc ? size - std::hypot(x - u, y - v)
             : std::min(0.12F - std::abs(x - u + 0.5F * (y - v)), 1.4F * size - std::abs(y - v));
    colour = blend(colour, paint, smooth_step(-0.03F, 0.03F, inside));
  }
  return colour;
}

/// Paints a framed picture over a wall at (u, v) metres.
Colour hang_picture(Colour wall, float u, float v, float half_width, float half_height,
                    std::uint32_t stream) {
  if (std::abs(u) > half_width + 0.1F || std::abs(v) > half_height + 0.1F) return wall;
  wall = blend(wall, colour_from_srgb(46, 36, 30), rectangle(u, v, half_width + 0.05F, half_height + 0.05F));
  wall =
      blend(wall, colour_from_srgb(238, 232, 218), rectangle(u, v, half_width + 0.02F, half_height + 0.02F));
  return blend(wall, abstract_picture(u / half_width, v / half_height, stream),
               rectangle(u, v, half_width, half_height));
}

/// A window: sky over hills behind white bars.
Colour cut_window(Colour wall, float u, float v, float half_width, float half_height) {
  wall =
      blend(wall, colour_from_srgb(244, 242, 236), rectangle(u, v, half_width + 0.07F, half_height + 0.07F));
  const float hill = -0.25F + 0.12F * std::sin(4.1F * u + 0.7F) + 0.05F * std::sin(11.0F * u);
  Colour view =
      blend(colour_from_srgb(216, 236, 250), colour_from_srgb(112, 172, 232), smooth_step(-0.4F, 0.7F, v));
  view = blend(view, colour_from_srgb(252, 252, 252),
               smooth_step(0.1F, 0.5F, cloud_noise({3 * u, 6 * v, 0}, 77)));
  view = blend(view, colour_from_srgb(98, 148, 84), smooth_step(-0.01F, 0.01F, hill - v));
  const float bars = std::max(1.0F - smooth_step(0.015F, 0.025F, std::abs(u)),
                              1.0F - smooth_step(0.015F, 0.025F, std::abs(v - 0.1F)));
  view = blend(1.5F * view, colour_from_srgb(240, 238, 232), bars);
  return blend(wall, view, rectangle(u, v, half_width, half_height));
}

Colour book_spines(float x, float y, const Colour& wood, std::uint32_t stream) {
  const float shelf = 0.4F;
  const int row = static_cast<int>(std::floor(y / shelf));
  const float height = y - shelf * static_cast<float>(row);
  const float slot =
      x / 0.055F + 0.35F * std::sin(9.0F * x + 2.0F * static_cast<float>(row));  // uneven widths
  const int book = static_cast<int>(std::floor(slot));
  const float within = slot - static_cast<float>(book);
  const float top = 0.2F + 0.13F * lattice_random(book, row, 0, stream);
  const float hue = lattice_random(book, row, 1, stream);
  Colour spine = colour_from_hue(hue, 0.35F + 0.5F * lattice_random(book, row, 2, stream),
                                 0.35F + 0.55F * lattice_random(book, row, 3, stream));
  const float band = 1.0F - smooth_step(0.008F, 0.016F, std::abs(height - 0.7F * top));
  spine = blend(spine, colour_from_srgb(232, 214, 160), 0.8F * band);
  spine *=
      1.0F - 0.5F * std::max(1.0F - smooth_step(0.02F, 0.12F, within), smooth_step(0.88F, 0.98F, within));
  const Colour dark = 0.12F * wood;
  const Colour filled = blend(spine, dark, smooth_step(-kEdge, kEdge, height - top));
  const float board = std::max(1.0F - smooth_step(0.025F, 0.033F, height), smooth_step(0.392F, 0.4F, height));
  return blend(filled, wood, board);
}

}  // namespace

Colour Room::floor(const Point& p) const {
  Colour colour = boards(p.x(), p.z(), 0.16F, 1.3F, colour_from_srgb(198, 146, 96), seed_ + 10);
  // A rug: borders, a lattice of diamonds and a medallion.
  const float half_x = 1.45F, half_z = 1.15F;
  const float inset = std::min(half_x - std::abs(p.x()), half_z - std::abs(p.z()));
  if (inset < -kEdge) return colour;
  const float hue = 0.97F + 0.1F * lattice_random(2, 0, 0, seed_);
  const Colour ground = colour_from_hue(hue, 0.68F, 0.62F), cream = colour_from_srgb(232, 216, 184);
  const Colour navy = colour_from_hue(hue + 0.6F, 0.6F, 0.36F), gold = colour_from_srgb(214, 160, 70);
  const float diamond =
      std::abs(std::fmod(p.x() + 10.0F, 0.3F) - 0.15F) + std::abs(std::fmod(p.z() + 10.0F, 0.3F) - 0.15F);
  Colour rug = blend(ground, gold, 1.0F - smooth_step(0.045F, 0.06F, diamond));
  rug = blend(rug, navy, 1.0F - smooth_step(0.008F, 0.018F, std::abs(diamond - 0.15F)));
  const float radius = std::hypot(p.x() / 0.62F, p.z() / 0.5F);
  const float petals = 1.0F + 0.12F * std::cos(8.0F * std::atan2(p.z(), p.x()));
  rug = blend(rug, navy, 1.0F - smooth_step(0.98F, 1.02F, radius / petals));
  rug = blend(rug, cream, 1.0F - smooth_step(0.03F, 0.05F, std::abs(radius / petals - 0.86F)));
  rug = blend(rug, ground, 1.0F - smooth_step(0.5F, 0.54F, radius / petals));
  rug = blend(rug, gold, 1.0F - smooth_step(0.2F, 0.24F, radius / petals));
  rug = blend(navy, rug, smooth_step(0.16F - kEdge, 0.16F + kEdge, inset));
  rug = blend(rug, cream, (1.0F - smooth_step(0.012F, 0.022F, std::abs(inset - 0.16F))));
  const float beads = 0.5F + 0.5F * std::sin(std::numbers::pi_v<float> * (p.x() + p.z()) / 0.06F);
  rug = blend(rug, cream,
              smooth_step(0.3F, 0.7F, beads) * (1.0F - smooth_step(0.02F, 0.035F, std::abs(inset - 0.08F))));
  rug *= 1.0F + 0.14F * cloud_noise({24.0F * p.x(), 24.0F * p.z(), 0.0F}, seed_ + 11);
  return blend(colour, rug, smooth_step(-kEdge, kEdge, inset));
}

Colour Room::wall(const RoomHit& hit) const {
  const Point& p = hit.position;
  if (hit.normal.y() < -0.5F) {  // ceiling
    return colour_from_srgb(236, 230, 220) * (1.0F - 0.4F * lines(p.x(), 1.0F, 0.05F));
  }
  Colour colour;
  const bool back = hit.normal.z() > 0.5F;
  const float u = back ? p.x() : p.z();
  if (back) {
    colour = bricks(u, p.y(), seed_ + 20);
    colour = hang_picture(colour, u - 1.15F, p.y() - 1.62F, 0.52F, 0.36F, seed_ + 21);
    colour = hang_picture(colour, u - 2.35F, p.y() - 1.7F, 0.26F, 0.36F, seed_ + 22);
    colour = hang_picture(colour, u + 0.1F, p.y() - 1.9F, 0.24F, 0.24F, seed_ + 23);
  } else {
    const Colour paint = colour_from_hue(0.1F + 0.35F * lattice_random(3, 0, 0, seed_), 0.22F, 0.86F);
    colour = paint * (1.0F + 0.1F * cloud_noise({2.2F * p.x(), 2.2F * p.y(), 2.2F * p.z()}, seed_ + 24));
    const float motif = std::sin(21.0F * u) * std::sin(21.0F * p.y());  // wallpaper
    colour = blend(colour, 0.62F * paint, 0.55F * smooth_step(0.35F, 0.6F, std::abs(motif)));
    const Colour panel = colour_from_srgb(226, 216, 198);
    const float groove = lines(u, 0.22F, 0.012F);
    colour = blend(colour, panel * (1.0F - 0.4F * groove), 1.0F - smooth_step(-kEdge, kEdge, p.y() - 0.85F));
    if (hit.normal.x() > 0.5F) colour = cut_window(colour, u + 0.9F, p.y() - 1.55F, 0.5F, 0.52F);
    if (hit.normal.x() < -0.5F)
      colour = hang_picture(colour, u + 0.6F, p.y() - 1.6F, 0.42F, 0.42F, seed_ + 25);
    colour = blend(colour, 0.8F * panel, 1.0F - smooth_step(0.02F, 0.03F, std::abs(p.y() - 0.86F)));
  }
  return blend(colour, colour_from_srgb(222, 212, 196),
               1.0F - smooth_step(0.1F, 0.11F, p.y()));  // skirting board
}

Colour Room::furniture(const Furniture& piece, const RoomHit& hit) const {
  const Point& p = hit.local;
  const Point& n = hit.local_normal;
  const bool side = std::abs(n.x()) > 0.5F, top = std::abs(n.y()) > 0.5F;
  const float u = side ? p.z() : p.x(), v = top ? p.z() : p.y();  // on a box's face
  const auto stream = seed_ + 40 + static_cast<std::uint32_t>(hit.piece);
  switch (piece.material) {
    case Material::bookshelf: {
      const Colour wood = boards(p.y(), u, 0.2F, 2.0F, piece.colour, stream);
      if (n.z() < 0.5F) return wood;
      const float frame = rectangle(p.x(), p.y(), piece.half.x() - 0.04F, piece.half.y() - 0.04F);
      return blend(wood, book_spines(p.x(), p.y() + piece.half.y(), piece.colour, stream), frame);
    }
    case Material::fabric: {
      const float check = lines(u, 0.16F, 0.03F) + lines(v, 0.16F, 0.03F);
      const float weave = 0.1F * cloud_noise({30.0F * u, 30.0F * v, 0.0F}, stream);
      return blend(piece.colour, colour_from_srgb(240, 226, 200), 0.35F * check) * (1.0F + weave);
    }
    case Material::crate: {
      const Colour wood = boards(u, v + 5.0F, 0.11F, 0.9F, piece.colour, stream);
      const float half_u = side ? piece.half.z() : piece.half.x(),
                  half_v = top ? piece.half.z() : piece.half.y();
      const float border = std::min(half_u - std::abs(u), half_v - std::abs(v));
      const float brace = std::abs(u / half_u - v / half_v) * half_v * 0.7F;
      const float rail =
          std::max(1.0F - smooth_step(0.05F, 0.058F, border), 1.0F - smooth_step(0.035F, 0.043F, brace));
      return blend(wood, 0.7F * boards(v, u, 0.3F, 1.0F, piece.colour, stream + 1), rail);
    }
    case Material::pottery: {
      const float bands = lines(p.y(), 0.1F, 0.025F),
                  zigzag = lines(p.y() + 0.03F * std::sin(60.0F * u), 0.1F, 0.012F);
      return blend(blend(piece.colour, colour_from_srgb(240, 222, 190), bands), 0.3F * piece.colour,
                   0.6F * zigzag);
    }
    case Material::leaves: {
      const float large = value_noise(13.0F * p, stream), small = value_noise(27.0F * p, stream + 1);
      const float light = 0.5F + 0.5F * std::clamp(large + 0.6F * small, -1.0F, 1.0F);
      return blend(0.22F * piece.colour, 1.7F * piece.colour, light * light);
    }
    case Material::lamp:
      return piece.colour * (1.5F - 0.35F * lines(std::atan2(p.x(), p.z()), 0.5236F, 0.06F));
    case Material::ball: {
      const float sector = std::atan2(p.x(), p.z()) * 3.0F / std::numbers::pi_v<float>;
      const float stripe = smooth_step(-0.1F, 0.1F, std::sin(sector * std::numbers::pi_v<float>));
      const float cap = smooth_step(0.125F, 0.135F, std::abs(p.y()));
      return blend(blend(piece.colour, colour_from_srgb(244, 236, 214), stripe),
                   colour_from_srgb(52, 96, 160), cap);
    }
    case Material::wood:
      break;
  }
  return boards(u, v + 5.0F, 0.12F, 1.0F, piece.colour, stream);
}

}  // namespace vivant::synth
