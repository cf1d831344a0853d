#include "jobs/style_preview.hpp"

#include "jobs/feature_step.hpp"
#include "vivant/io/image.hpp"

namespace vivant {
namespace {

constexpr std::size_t measured_views = 8;

/// F_c of a whole view, [h, w, 256].
std::vector<float> features_of(Device& device, const CaptureModel& model, const FeatureView& view) {
  Graph graph;
  const Value hidden = graph.input("hidden", {view.hidden.rows, view.hidden.cols, view.hidden.channels()});
  const Value features = rendered_features(graph, model, hidden);
  Executor executor(device, graph, {features});
  executor.write(hidden, floats_of(view.hidden));
  executor.run();
  return executor.read(features);
}

FrameStylizer frame_stylizer(Device& device, const Config& config, const CaptureModel& model,
                             const Vgg19& vgg, const FeatureView& view) {
  return {device, model.stylizer(), vgg, view.rgb.rows, view.rgb.cols, {.tokens = config.style.tokens}};
}

}  // namespace

ContentNorm measured_norm(Device& device, const Config& config, const CaptureModel& model, const Vgg19& vgg,
                          const std::vector<FeatureView>& views) {
  std::vector<std::vector<float>> features;
  std::vector<RenderedFrame> frames;
  const std::size_t count = std::min(measured_views, views.size());
  for (std::size_t i = 0; i < count; ++i) {
    const FeatureView& view = views[i * views.size() / count];
    features.push_back(features_of(device, model, view));
    frames.push_back({features.back(), floats_of(view.rgb)});
  }
  return frame_stylizer(device, config, model, vgg, views.front()).measure(frames);
}

cv::Mat stylised_view(Device& device, const Config& config, const CaptureModel& model, const Vgg19& vgg,
                      const FeatureView& view, const cv::Mat& style) {
  const std::vector<float> features = features_of(device, model, view);
  const RenderedFrame frame{features, floats_of(view.rgb)};
  FrameStylizer stylizer = frame_stylizer(device, config, model, vgg, view);
  const bool plain = style.empty();
  stylizer.set_style(plain ? cv::Mat(64, 64, CV_8UC3, cv::Scalar::all(128)) : style,
                     model.content_norm().read(), {&frame, 1});
  std::vector<float> colours = stylizer.stylise(frame, plain ? 0 : 1);
  return cv::Mat(view.rgb.size(), CV_32FC3, colours.data()).clone();
}

cv::Mat preview_sheet(const std::vector<cv::Mat>& pictures) {
  cv::Mat sheet;
  cv::hconcat(pictures, sheet);
  sheet.convertTo(sheet, CV_8U, 255);
  return sheet;
}

}  // namespace vivant
