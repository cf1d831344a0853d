#include "jobs/training_pictures.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/runtime/error.hpp"

using namespace vivant;

namespace {

const std::filesystem::path styles = asset_path("styles");

std::vector<float> crop(const TrainingPictures& pictures, std::uint64_t seed, std::int64_t step) {
  KeyedRandom random(seed, "test", step);
  const cv::Mat picture = pictures.crop(random, 40, 1);
  const auto values = floats_of(picture);
  return {values.begin(), values.end()};
}

}  // namespace

TEST_CASE("training pictures: the same seed and step give the same crop, others another; all within [0, 1]") {
  const TrainingPictures pictures({styles}, 100, 64, {});
  CHECK(crop(pictures, 1, 5) == crop(pictures, 1, 5));
  CHECK(crop(pictures, 1, 5) != crop(pictures, 1, 6));
  CHECK(crop(pictures, 1, 5) != crop(pictures, 2, 5));
  for (std::int64_t step = 0; step < 20; ++step)
    for (const float value : crop(pictures, 3, step)) REQUIRE((value >= 0 && value <= 1));
}

TEST_CASE("training pictures: those that must stay unseen are left out, and can be asked for") {
  const TrainingPictures all({styles}, 100, 64, {}), fewer({styles}, 100, 64, {"impasto", "mosaic"});
  CHECK(fewer.size() + 2 == all.size());
  CHECK(pictures_called({styles}, {"impasto", "mosaic"}, 100).size() == 2);
  CHECK_THROWS_AS(TrainingPictures({styles}, 100, 100000, {}), Error);
  CHECK_THROWS_AS(TrainingPictures({styles / "none"}, 100, 64, {}), Error);
}

TEST_CASE("keyed random numbers: normal ones have the deviation asked for") {
  KeyedRandom random(1, "normal", 0);
  std::vector<float> values(20000);
  random.fill_normal(values, 2);
  double sum = 0, square = 0;
  for (const float value : values) sum += value, square += value * value;
  CHECK(std::abs(sum / 20000) < 0.05);
  CHECK(std::sqrt(square / 20000) == doctest::Approx(2).epsilon(0.02));
}
