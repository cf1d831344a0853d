#include "vivant/model/view_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "vivant/data/camera_table.hpp"

namespace vivant {

cv::Mat RenderedView::rgb8() const {
  cv::Mat image(height, width, CV_8UC3);
  std::transform(pixels.begin(), pixels.end(), image.data, [](float x) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(x, 0.0f, 1.0f) * 255.0f));
  });
  return image;
}

SceneRenderer::SceneRenderer(Device& device, const SceneModel& scene, Options options)
    : device_(device), scene_(scene), options_(options), baked_(device, scene, options.weight_threshold) {}

void SceneRenderer::build(int width, int height) {
  executor_.reset();
  width_ = width;
  height_ = height;
  tile_ = std::min<std::int64_t>(options_.tile_rays, static_cast<std::int64_t>(width) * height);
  graph_ = std::make_unique<Graph>();
  Graph& graph = *graph_;
  const std::vector<float> table = camera_table(std::vector<Camera>(1));
  camera_ = graph.input("camera", {1, static_cast<std::int64_t>(table.size())});
  pixels_ = graph.input("pixels", {tile_}, DType::i32);
  const Rays rays = ray_generation(camera_, pixels_, width, height);
  const FieldSamples samples = baked_.sample(graph, rays, options_.output);
  const RenderedRays rendered = scene_.render(graph, samples, options_.weight_threshold);
  output_ = scene_.field().output(graph, options_.output, rendered.hidden, rendered.alpha);
  alpha_ = rendered.alpha;
  depth_ = rendered.depth;
  executor_ = std::make_unique<Executor>(device_, graph, Values{output_, alpha_, depth_});
}

RenderedView SceneRenderer::render(const Camera& camera) {
  if (!executor_ || width_ != camera.width || height_ != camera.height) build(camera.width, camera.height);
  RenderedView view;
  view.width = camera.width;
  view.height = camera.height;
  const std::int64_t pixels = static_cast<std::int64_t>(camera.width) * camera.height, tile = tile_;
  const std::int64_t channels = output_.shape().channels();
  view.pixels.resize(pixels * channels);
  view.alpha.resize(pixels);
  view.depth.resize(pixels);
  executor_->write(camera_, std::span<const float>(camera_table(std::span(&camera, 1))));
  std::vector<std::int32_t> ids(tile);
  for (std::int64_t first = 0; first < pixels; first += tile) {
    for (std::int64_t i = 0; i < tile; ++i)
      ids[i] = static_cast<std::int32_t>(std::min(first + i, pixels - 1));
    executor_->write(pixels_, std::span<const std::int32_t>(ids));
    executor_->run();
    const std::int64_t count = std::min(tile, pixels - first);
    const auto copy = [&](Value value, std::vector<float>& to, std::int64_t channels) {
      const std::vector<float> data = executor_->read(value);
      std::copy_n(data.begin(), count * channels, to.begin() + first * channels);
    };
    copy(output_, view.pixels, channels);
    copy(alpha_, view.alpha, 1);
    copy(depth_, view.depth, 1);
  }
  return view;
}

}  // namespace vivant
