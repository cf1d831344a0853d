#include "vivant/model/colour_match.hpp"

#include <doctest/doctest.h>

#include "vivant/nn/parameters.hpp"

using namespace vivant;

namespace {

/// Normal colours around `mean` with deviations along the axes.
std::vector<float> colours(std::uint64_t seed, const Eigen::Vector3d& mean,
                           const Eigen::Vector3d& deviation) {
  std::vector<float> pixels = Initializer(seed).normal("colours", 3 * 2000, 1);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<float>(mean[i % 3] + deviation[i % 3] * pixels[i]);
  return pixels;
}

ColourStatistics statistics(const std::vector<float>& pixels) {
  ColourStatistics result;
  result.add(pixels);
  return result;
}

}  // namespace

TEST_CASE("colour match: the full match takes on mean and covariance of the painting") {
  std::vector<float> picture = colours(1, {0.4, 0.5, 0.6}, {0.05, 0.06, 0.04});
  const ColourStatistics goal = statistics(colours(2, {0.6, 0.45, 0.4}, {0.06, 0.04, 0.05}));
  match_colours(statistics(picture), goal).apply(picture);
  const ColourStatistics after = statistics(picture);
  CHECK((after.mean - goal.mean).norm() < 1e-3);
  CHECK((after.covariance - goal.covariance).norm() < 1e-4);
}

TEST_CASE("colour match: eigenvalues are clamped, half the amount goes half the way") {
  const ColourStatistics from = statistics(colours(3, {0.5, 0.5, 0.5}, {0.01, 0.2, 0.1}));
  const ColourStatistics to = statistics(colours(4, {0.3, 0.5, 0.7}, {0.1, 0.02, 0.1}));
  const ColourTransform full = match_colours(from, to), half = full.blended(0.5);
  CHECK(full.matrix(0, 0) == doctest::Approx(1.5).epsilon(0.01));
  CHECK(full.matrix(1, 1) == doctest::Approx(0.5).epsilon(0.01));
  const Eigen::Vector3d halfway = half.matrix * from.mean + half.offset;
  CHECK((halfway - 0.5 * (from.mean + to.mean)).norm() < 1e-6);
}

TEST_CASE("colour match: statistics taken in parts are those of the whole") {
  const std::vector<float> pixels = colours(5, {0.3, 0.4, 0.5}, {0.1, 0.2, 0.05});
  ColourStatistics parts;
  parts.add({pixels.data(), 900});
  parts.add({pixels.data() + 900, pixels.size() - 900});
  const ColourStatistics whole = statistics(pixels);
  CHECK((parts.mean - whole.mean).norm() < 1e-9);
  CHECK((parts.covariance - whole.covariance).norm() < 1e-9);
}

TEST_CASE("colour match: take_chroma keeps the luma of one picture and the chroma of the other") {
  const auto luma = [](const float* p) { return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]; };
  std::vector<float> pixels = colours(5, {0.6, 0.5, 0.4}, {0.05, 0.05, 0.05});
  const std::vector<float> light = pixels, chroma = colours(6, {0.3, 0.45, 0.6}, {0.05, 0.05, 0.05});
  take_chroma(pixels, chroma);
  for (std::size_t i = 0; i < pixels.size(); i += 3) {
    CHECK(luma(&pixels[i]) == doctest::Approx(luma(&light[i])).epsilon(1e-5));
    CHECK(pixels[i] - pixels[i + 2] == doctest::Approx(chroma[i] - chroma[i + 2]).epsilon(1e-4));
  }
  // Towards white a colour fades, but keeps its luma and its hue.
  std::vector<float> bright = {0.9f, 0.9f, 0.9f};
  take_chroma(bright, std::vector<float>{1, 0, 0});
  CHECK(luma(bright.data()) == doctest::Approx(0.9));
  CHECK(bright[0] == doctest::Approx(1));
  CHECK(bright[1] == doctest::Approx(bright[2]));
}
