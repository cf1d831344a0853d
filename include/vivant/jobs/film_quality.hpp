#pragma once
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "vivant/jobs/progress.hpp"
#include "vivant/jobs/report.hpp"
#include "vivant/model/style_score.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// A film to be measured.
struct NamedFilm {
  std::string name;
  std::vector<cv::Mat> frames;  ///< CV_8UC3 RGB
};

/// How much a film changes where the world does not: frame t against frame t + gap, warped to t, over the
/// visible pixels.
struct GapScore {
  int gap = 1;
  std::vector<double> stlpips, rmse;  ///< by t; NaN where too little is visible
  double mean_stlpips = 0, mean_rmse = 0;
};

struct FilmScore {
  std::string name;
  std::vector<GapScore> gaps;
  std::vector<StyleScore> style;  ///< of the frames `FilmQuality::style_frames`; none without a painting
  StyleScore mean_style;
};

/// Temporal consistency, style and content of films that show the same. The first one is unstylised: the
/// others' figures are to be read beside its own, since a blurred film without any style is the most
/// consistent one.
struct FilmQuality {
  int frames = 0;
  cv::Size size;
  std::string flow;               ///< where the flow comes from
  std::vector<int> gaps;          ///< those that the films are long enough for
  std::vector<double> visible;    ///< by gap: the mean share of the pixels that is compared
  std::vector<int> style_frames;  ///< those whose style is measured
  std::vector<FilmScore> films;

  Report report() const;
  nlohmann::ordered_json json() const;
};

/// The flow from frame `from` to frame `to`, see flow.hpp.
using FlowSource = std::function<cv::Mat(int from, int to)>;

/// Throws Error for a film that differs from the first in length or size.
void check_alike(const NamedFilm& first, const std::vector<NamedFilm>& films);

/// Measures films of as many frames of one size, of which the first one is unstylised. Without a painting
/// (CV_8UC3 RGB) style and content are left out. Throws Error for films that differ in length or size.
FilmQuality measure_films(Device& device, const std::vector<NamedFilm>& films, const FlowSource& flow,
                          const cv::Mat& painting, Progress& progress);

}  // namespace vivant
