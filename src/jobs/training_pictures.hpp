#pragma once
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace vivant {

/// Random numbers that depend on what they are for alone (seed, stage, step), not on what was drawn before:
/// an interrupted training goes on with the same ones.
class KeyedRandom {
 public:
  KeyedRandom(std::uint64_t seed, const std::string& stage, std::int64_t step);
  double uniform(double low = 0, double high = 1);
  bool chance(double probability) { return uniform() < probability; }
  std::int64_t below(std::int64_t end);
  /// Roughly normal numbers of this standard deviation; cheap enough for whole feature maps.
  void fill_normal(std::vector<float>& values, double deviation);

 private:
  std::uint64_t next();
  std::uint64_t state_;
};

/// The pictures in a folder and below, by name. Throws when it is no folder.
std::vector<std::filesystem::path> pictures_below(const std::filesystem::path& folder);

/// Photographs or paintings to train on, in memory.
class TrainingPictures {
 public:
  /// All pictures in a folder and below, by name, without those whose file name starts with one of
  /// `left_out`. Their short side is reduced to `short_side`; smaller ones than `least_side` are left out.
  /// Throws when none is left.
  TrainingPictures(const std::vector<std::filesystem::path>& folders, int short_side, int least_side,
                   const std::vector<std::string>& left_out);

  std::size_t size() const { return pictures_.size(); }
  const cv::Mat& operator[](std::size_t i) const { return pictures_[i]; }

  /// A random square of a random picture, `side` pixels, CV_32FC3 RGB in [0,1]: cut out at half the picture's
  /// size or more, flipped in half of all cases, and with the probability `recolour` with changed colours.
  cv::Mat crop(KeyedRandom& random, int side, double recolour) const;

 private:
  std::vector<cv::Mat> pictures_;
};

/// The pictures in a folder and below whose file name starts with one of `starts`, CV_32FC3 RGB in [0,1],
/// short side reduced to `short_side`.
std::vector<cv::Mat> pictures_called(const std::vector<std::filesystem::path>& folders,
                                     const std::vector<std::string>& starts, int short_side);

}  // namespace vivant
