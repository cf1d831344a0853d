#include "vivant/model/brushwork.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <random>

namespace vivant {
namespace {

constexpr int tones = 6;                                 // of a painting
constexpr double brush_of_frame = 0.018;                 // of the root of its area
constexpr double narrowest_brush = 1, widest_brush = 8;  // pixels
// In widths of a brush:
constexpr double painting_side = 88, patch_side = 12, patch_overlap = 4;
constexpr int patches_a_side = 12;          // of a swatch
constexpr double strongest_strokes = 0.08;  // rms: more would hide what is painted
constexpr float tone_distance = 12;         // in CIELAB, by which a swatch's weight falls to 1 / e
constexpr float least_weight = 0.02f;

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
  places.resize(std::max<std::size_t>(1, places.size() / 12));
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

}  // namespace

std::vector<Swatch> swatches_of(const cv::Mat& painting, double brush) {
  cv::Mat picture;
  painting.convertTo(picture, CV_32F, 1 / 255.0);
  const double factor = painting_side * brush / std::sqrt(picture.size().area());
  if (factor < 1) cv::resize(picture, picture, {}, factor, factor, cv::INTER_AREA);
  const cv::Mat even = blurred(picture, brush), detail = picture - even, lab = lab_of(even);
  const int shorter = std::min(picture.rows, picture.cols);
  const int patch = std::min(shorter, static_cast<int>(std::lround(patch_side * brush))),
            overlap = static_cast<int>(patch * patch_overlap / patch_side);
  const cv::Mat centres = tones_of(lab);
  std::mt19937 random(1);
  std::vector<Swatch> swatches;
  for (int i = 0; i < centres.rows; ++i) {
    Swatch swatch{centres.at<cv::Vec3f>(i, 0), {}};
    swatch.strokes = patchwork(detail, places_of(lab, swatch.tone, patch), patch, overlap, random);
    swatch.rms = std::sqrt(std::pow(cv::norm(swatch.strokes), 2) /
                           (3.0 * static_cast<double>(swatch.strokes.total())));
    if (swatch.rms > strongest_strokes) {
      swatch.strokes *= strongest_strokes / swatch.rms;
      swatch.rms = strongest_strokes;
    }
    swatches.push_back(std::move(swatch));
  }
  return swatches;
}

Brushwork::Brushwork(std::span<const StylePicture> paintings, cv::Size frame) : brush_(brush_of(frame)) {
  for (const StylePicture& painting : paintings)
    for (Swatch& swatch : swatches_of(painting.picture, brush_)) {
      swatch.weight = painting.weight;
      swatches_.push_back(std::move(swatch));
    }
}

void Brushwork::lay_onto(cv::Mat& picture, const SurfaceTexture& surfaces, double amount) const {
  const cv::Mat even = blurred(picture, brush_), lab = lab_of(even), detail = picture - even;
  cv::Mat energy;
  cv::transform(detail.mul(detail), energy, cv::Matx13f::all(1.0f / 3));
  energy = blurred(energy, brush_);
  std::vector<float> weights(swatches_.size());
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      float nearest = std::numeric_limits<float>::max(), squares = 0;
      for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] = static_cast<float>(cv::norm(lab.at<cv::Vec3f>(y, x) - swatches_[i].tone));
        nearest = std::min(nearest, weights[i]);
      }
      for (std::size_t i = 0; i < weights.size(); ++i) {
        weights[i] =
            static_cast<float>(swatches_[i].weight) * std::exp((nearest - weights[i]) / tone_distance);
        squares += weights[i] * weights[i];
      }
      cv::Vec3f strokes(0, 0, 0);
      for (std::size_t i = 0; i < weights.size(); ++i) {
        const float weight = weights[i] / std::sqrt(squares);
        if (weight < least_weight) continue;
        const double own = std::pow(swatches_[i].rms, 2);
        if (own == 0) continue;
        const double room = std::sqrt(own / (own + energy.at<float>(y, x)));
        strokes += static_cast<float>(weight * room * amount) * surfaces.at(y, x, swatches_[i].strokes);
      }
      picture.at<cv::Vec3f>(y, x) += strokes;
    }
  cv::max(picture, 0.0, picture);
  cv::min(picture, 1.0, picture);
}

}  // namespace vivant
