#include "jobs/stylizer_preview.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "vivant/io/image.hpp"
#include "vivant/model/frame_stylizer.hpp"

namespace vivant {
namespace {

constexpr int height = 192, width = 256, shown_photographs = 4, shown_styles = 5;

/// The features of a photograph [height, width, 3].
std::vector<float> features_of(const StylizerTraining& training, const cv::Mat& photograph) {
  Graph graph;
  const Value picture = graph.input("photograph", {photograph.rows, photograph.cols, 3});
  const Value features = style_features(training.vgg, picture, 3)[2];
  Executor executor(training.device, graph, {features});
  executor.write(picture, floats_of(photograph));
  executor.run();
  return executor.read(features);
}

cv::Mat eight_bit(const cv::Mat& picture) {
  cv::Mat result;
  picture.convertTo(result, CV_8U, 255);
  return result;
}

/// The middle of a picture at the sheet's size.
cv::Mat thumbnail(const cv::Mat& picture) {
  const double factor =
      std::max(static_cast<double>(height) / picture.rows, static_cast<double>(width) / picture.cols);
  cv::Mat result;
  cv::resize(picture, result, {}, factor, factor, cv::INTER_AREA);
  return result(cv::Rect((result.cols - width) / 2, (result.rows - height) / 2, width, height)).clone();
}

}  // namespace

void write_preview(const StylizerTraining& training, const std::filesystem::path& path, bool with_styles) {
  std::vector<cv::Mat> photographs, styles, rows;
  for (int i = 0; i < shown_photographs; ++i)
    photographs.push_back(
        thumbnail(training.photographs[(2 * i + 1) * training.photographs.size() / (2 * shown_photographs)]));
  if (with_styles) {
    styles = training.unseen;
    for (std::size_t i = 0; styles.size() < shown_styles && i < training.paintings.size(); i += 4)
      styles.push_back(training.paintings[i]);
  }
  std::vector<cv::Mat> top(2, cv::Mat(height, width, CV_8UC3, cv::Scalar::all(255)));
  for (const cv::Mat& style : styles) top.push_back(eight_bit(thumbnail(style)));
  cv::hconcat(top, rows.emplace_back());

  FrameStylizer stylizer(training.device, training.stylizer, training.vgg, height, width,
                         FrameStylizer::Options::of(training.stylizer));
  for (const cv::Mat& photograph : photographs) {
    const std::vector<float> features = features_of(training, photograph);
    const RenderedFrame frame{features, floats_of(photograph)};
    std::vector<cv::Mat> row = {eight_bit(photograph)};
    const auto show = [&](double strength) {
      std::vector<float> colours = stylizer.stylise(frame, strength);
      row.push_back(eight_bit(cv::Mat(height, width, CV_32FC3, colours.data())));
    };
    const ContentNorm norm = stylizer.measure({&frame, 1});
    stylizer.set_style(eight_bit(styles.empty() ? training.paintings[0] : styles[0]), norm, {&frame, 1});
    show(0);
    for (const cv::Mat& style : styles) {
      stylizer.set_style(eight_bit(style), norm, {&frame, 1});
      show(1);
    }
    cv::hconcat(row, rows.emplace_back());
  }
  cv::Mat sheet;
  cv::vconcat(rows, sheet);
  write_image(path, sheet);
}

}  // namespace vivant
