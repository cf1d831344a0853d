#include "vivant/model/brushwork.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <random>

#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

constexpr int tones = 6;                                 // of a painting
constexpr double brush_of_frame = 0.018;                 // of the root of its area
constexpr double narrowest_brush = 1, widest_brush = 8;  // pixels
constexpr int smallest_side = 16;                        // of a painting, in pixels
// In widths of a brush, the sigma of a Gaussian in texels:
constexpr double painting_side = 88, patch_side = 12, patch_overlap = 4;
constexpr int patches_a_side = 8;           // of a swatch
constexpr double strongest_strokes = 0.08;  // rms: more would hide what is painted
constexpr float tone_distance = 12;         // in CIELAB, by which a swatch's weight falls to 1 / e
constexpr float least_weight = 0.02f;
constexpr float tone_tolerance = 6;  // in CIELAB, of a patch beside the best one
constexpr std::size_t fewest_places = 4;

cv::Mat blurred(const cv::Mat& picture, double sigma) {
  cv::Mat result;
  cv::GaussianBlur(picture, result, {}, sigma);
  return result;
}

cv::Mat lab_of(const cv::Mat& rgb) {
  cv::Mat inside = cv::min(cv::max(rgb, 0.0), 1.0), lab;
  cv::cvtColor(inside, lab, cv::COLOR_RGB2Lab);
  return lab;
}

/// The tones of a picture in CIELAB by k-means, which starts from equal parts ordered by lightness.
cv::Mat tones_of(const cv::Mat& lab) {
  std::vector<cv::Vec3f> pixels(lab.begin<cv::Vec3f>(), lab.end<cv::Vec3f>());
  std::sort(pixels.begin(), pixels.end(), [](const cv::Vec3f& a, const cv::Vec3f& b) {
    return std::lexicographical_compare(a.val, a.val + 3, b.val, b.val + 3);
  });
  const cv::Mat points(static_cast<int>(pixels.size()), 3, CV_32FC1, pixels.data());
  cv::Mat labels(points.rows, 1, CV_32SC1), centres;
  for (int i = 0; i < points.rows; ++i)
    labels.at<int>(i) = static_cast<int>(static_cast<std::int64_t>(i) * tones / points.rows);
  cv::kmeans(points, tones, labels, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.1}, 1,
             cv::KMEANS_USE_INITIAL_LABELS, centres);
  return centres;
}

/// The middles of patches that have the tone everywhere, as far as the picture has such.
std::vector<cv::Point> places_of(const cv::Mat& lab, const cv::Vec3f& tone, int patch) {
  cv::Mat distances(lab.size(), CV_32FC1), means;
  for (int y = 0; y < lab.rows; ++y)
    for (int x = 0; x < lab.cols; ++x)
      distances.at<float>(y, x) = static_cast<float>(cv::norm(lab.at<cv::Vec3f>(y, x) - tone));
  cv::blur(distances, means, {patch, patch});
  std::vector<cv::Point> places;
  for (int y = patch / 2; y + patch - patch / 2 <= lab.rows; y += 2)
    for (int x = patch / 2; x + patch - patch / 2 <= lab.cols; x += 2) places.emplace_back(x, y);
  std::stable_sort(places.begin(), places.end(), [&](const cv::Point& a, const cv::Point& b) {
    return means.at<float>(a) < means.at<float>(b);
  });
  std::size_t count = std::min(fewest_places, places.size());
  const float most = means.at<float>(places[0]) + tone_tolerance;
  while (count < places.size() / 12 && means.at<float>(places[count]) <= most) ++count;
  places.resize(count);
  return places;
}

/// The share of a patch along one side: it fades where its neighbours overlap it.
std::vector<float> fading(int patch, int overlap) {
  std::vector<float> shares(patch, 1.0f);
  for (int i = 0; i < overlap; ++i) {
    const double part = std::sin((i + 0.5) / overlap * CV_PI / 2);
    shares[i] = shares[patch - 1 - i] = static_cast<float>(part * part);
  }
  return shares;
}

/// Patches of `detail` around places drawn from the list, side by side, with the mean square that they had.
cv::Mat patchwork(const cv::Mat& detail, const std::vector<cv::Point>& places, int patch, int overlap,
                  std::mt19937& random) {
  const int step = patch - overlap, side = patches_a_side * step;
  const std::vector<float> shares = fading(patch, overlap);
  cv::Mat sum(side, side, CV_32FC3, cv::Scalar::all(0)), squares(side, side, CV_32FC1, cv::Scalar(0));
  for (int row = 0; row < patches_a_side; ++row)
    for (int column = 0; column < patches_a_side; ++column) {
      const cv::Point from = places[random() % places.size()] - cv::Point(patch / 2, patch / 2);
      for (int y = 0; y < patch; ++y)
        for (int x = 0; x < patch; ++x) {
          const float share = shares[y] * shares[x];
          const int v = (row * step + y) % side, u = (column * step + x) % side;
          sum.at<cv::Vec3f>(v, u) += share * detail.at<cv::Vec3f>(from.y + y, from.x + x);
          squares.at<float>(v, u) += share * share;
        }
    }
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) sum.at<cv::Vec3f>(y, x) *= 1 / std::sqrt(squares.at<float>(y, x));
  return sum - cv::mean(sum);
}

double brush_of(cv::Size frame) {
  return std::clamp(brush_of_frame * std::sqrt(frame.area()), narrowest_brush, widest_brush);
}

/// The weights of the swatches for a colour in CIELAB, or its lightness; their squares sum up to 1.
std::vector<float> weights_at(const cv::Vec3f& lab, const std::vector<Swatch>& swatches, bool by_lightness) {
  std::vector<float> weights;
  weights.reserve(swatches.size());
  for (const Swatch& swatch : swatches) {
    const cv::Vec3f apart = lab - swatch.tone;
    weights.push_back(by_lightness ? std::abs(apart[0]) : static_cast<float>(cv::norm(apart)));
  }
  const float nearest = *std::min_element(weights.begin(), weights.end());
  float squares = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = static_cast<float>(swatches[i].share) * std::exp((nearest - weights[i]) / tone_distance);
    squares += weights[i] * weights[i];
  }
  for (float& weight : weights) weight /= std::sqrt(squares);
  return weights;
}

}  // namespace

std::vector<Swatch> swatches_of(const cv::Mat& painting, double brush) {
  const double factor = painting_side * brush / std::sqrt(painting.size().area());
  const auto side = [&](int pixels) {
    return std::max(smallest_side, static_cast<int>(std::lround(pixels * factor)));
  };
  cv::Mat picture;
  cv::resize(painting, picture, {side(painting.cols), side(painting.rows)}, 0, 0,
             factor < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  picture.convertTo(picture, CV_32F, 1 / 255.0);
  const cv::Mat even = blurred(picture, brush), detail = picture - even, lab = lab_of(even);
  const int patch = std::min({picture.rows, picture.cols, static_cast<int>(std::lround(patch_side * brush))}),
            overlap = static_cast<int>(patch * patch_overlap / patch_side);
  const cv::Mat centres = tones_of(lab);
  std::mt19937 random(1);
  std::vector<Swatch> swatches;
  for (int i = 0; i < centres.rows; ++i) {
    Swatch swatch{centres.at<cv::Vec3f>(i, 0), {}};
    swatch.strokes = patchwork(detail, places_of(lab, swatch.tone, patch), patch, overlap, random);
    const auto numbers = 3.0 * static_cast<double>(swatch.strokes.total());
    swatch.strokes *= std::min(1.0, strongest_strokes * std::sqrt(numbers) / cv::norm(swatch.strokes));
    swatch.mean_square = std::pow(cv::norm(swatch.strokes), 2) / numbers;
    swatches.push_back(std::move(swatch));
  }
  return swatches;
}

Brushwork::Brushwork(std::span<const StylePicture> paintings, cv::Size frame) : brush_(brush_of(frame)) {
  const std::vector<double> shares = shares_of(paintings);
  for (std::size_t i = 0; i < paintings.size(); ++i)
    for (Swatch& swatch : swatches_of(paintings[i].picture, brush_ / SurfaceTexture::texel)) {
      swatch.share = shares[i];
      swatches_.push_back(std::move(swatch));
    }
}

cv::Mat Brushwork::laid_onto(const cv::Mat& picture, const SurfaceTexture& surfaces, double amount,
                             bool by_lightness) const {
  if (picture.size() != surfaces.size())
    fail("a picture and the surfaces that it shows have different sizes");
  const cv::Mat even = blurred(picture, brush_), lab = lab_of(even), detail = picture - even;
  cv::Mat energy, result = picture.clone();
  cv::transform(detail.mul(detail), energy, cv::Matx13f::all(1.0f / 3));
  energy = blurred(energy, brush_);
  cv::parallel_for_({0, picture.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const std::vector<SurfaceTexture::Place> places = surfaces.places(y, x);
        const std::vector<float> weights = weights_at(lab.at<cv::Vec3f>(y, x), swatches_, by_lightness);
        for (std::size_t i = 0; i < weights.size(); ++i) {
          const double own = swatches_[i].mean_square;
          if (weights[i] < least_weight || own == 0) continue;
          const double room = std::sqrt(own / (own + energy.at<float>(y, x)));
          result.at<cv::Vec3f>(y, x) +=
              static_cast<float>(weights[i] * room * amount) * look_up(swatches_[i].strokes, places);
        }
      }
  });
  return cv::min(cv::max(result, 0.0), 1.0);
}

}  // namespace vivant
