#include "vivant/model/human_rays.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vivant {
namespace {

template <typename T>
std::shared_ptr<Buffer> uploaded(Device& device, const std::vector<T>& data) {
  auto buffer = std::make_shared<Buffer>(device.allocate(data.size() * sizeof(T)));
  device.write(*buffer, data.data(), data.size() * sizeof(T));
  return buffer;
}

Value table(Graph& graph, const std::string& name, const TensorType& type,
            const std::shared_ptr<Buffer>& buffer) {
  return graph.named(name, [&] { return graph.external(name, type, {buffer, 0}); });
}

/// Less than a fifth of a pixel leaves the pixels as they are.
cv::Mat softened(const cv::Mat& mask, double sigma) {
  if (sigma < 0.2) return mask;
  cv::Mat soft;
  cv::GaussianBlur(mask, soft, {}, sigma, sigma, cv::BORDER_REPLICATE);
  return soft;
}

}  // namespace

cv::Rect person_box(const cv::Mat& mask, const Camera& camera, const std::vector<Eigen::Vector3d>& posed,
                    int border) {
  const double far_away = 1e6;
  Eigen::Array2d low(far_away, far_away), high = -low;
  const auto include = [&](double x, double y) {
    low = low.min(Eigen::Array2d(x, y));
    high = high.max(Eigen::Array2d(x, y));
  };
  for (const Eigen::Vector3d& vertex : posed)
    if (const Eigen::Vector3d pixel = camera.project(vertex); pixel.z() > 0)
      include(std::clamp(pixel.x(), -far_away, far_away), std::clamp(pixel.y(), -far_away, far_away));
  if (const cv::Rect box = mask.empty() ? cv::Rect() : cv::boundingRect(mask); box.area() > 0) {
    include(box.x, box.y);
    include(box.br().x, box.br().y);
  }
  if (low.x() > high.x()) return {};
  const cv::Point from(static_cast<int>(std::floor(low.x())) - border,
                       static_cast<int>(std::floor(low.y())) - border);
  const cv::Point to(static_cast<int>(std::ceil(high.x())) + border,
                     static_cast<int>(std::ceil(high.y())) + border);
  return cv::Rect(from, to) & cv::Rect(0, 0, camera.width, camera.height);
}

HumanRays::HumanRays(Device& device, const BodyModel& body, const Capture& capture,
                     const std::vector<int>& frames, const std::vector<cv::Mat>& backgrounds,
                     const HumanRayOptions& options)
    : pool_(device, body, options.pool) {
  if (!capture.human) fail("{}: there is no person to train", capture.source.string());
  std::vector<std::uint8_t> colours, behind, masks;
  std::vector<std::int32_t> drawn, on_mask;
  for (std::size_t row = 0; row < frames.size(); ++row) {
    const CaptureFrame& frame = capture.frames[frames[row]];
    if (frame.body_frame < 0) fail("{}: the frame {} has no body_frame", capture.source.string(), frame.name);
    const Pose& pose = capture.human->poses.pose[frame.body_frame];
    const Eigen::Vector3d& translation = capture.human->poses.translation[frame.body_frame];
    const cv::Mat image = capture.image(frames[row]), stored = capture.soft_mask(frames[row]),
                  mask = stored > 127, coverage = softened(stored, options.mask_softness * image.rows),
                  &background = backgrounds.at(row);
    if (background.type() != CV_8UC3 || background.size() != image.size())
      fail("the background of {} is no RGB picture of {}x{} pixels", frame.name, image.cols, image.rows);
    const cv::Rect box =
        person_box(mask, frame.camera, skin(body.body(), joint_transforms(body.body(), pose, translation)),
                   static_cast<int>(std::lround(options.border * image.rows)));
    std::vector<Ray> rays;
    for (int y = box.y; y < box.br().y; ++y)
      for (int x = box.x; x < box.br().x; ++x) {
        const auto id = static_cast<std::int32_t>(masks.size());
        drawn.push_back(id);
        if (mask.at<std::uint8_t>(y, x) >= 128) on_mask.push_back(id);
        masks.push_back(coverage.at<std::uint8_t>(y, x));
        for (int c = 0; c < 3; ++c) {
          colours.push_back(image.at<cv::Vec3b>(y, x)[c]);
          behind.push_back(background.at<cv::Vec3b>(y, x)[c]);
        }
        rays.push_back(frame.camera.ray({x + 0.5, y + 0.5}));
      }
    pool_.add_frame(static_cast<int>(row), pose, translation, rays);
  }
  if (on_mask.empty()) fail("{}: the masks show no person", capture.source.string());
  pool_.finish();
  for (std::size_t i = 0; i < masks.size(); ++i) drawn.push_back(on_mask[i % on_mask.size()]);
  drawn_count_ = static_cast<std::int64_t>(drawn.size());
  const std::vector<int> counts = pool_.ray_sample_counts();
  for (const std::int32_t ray : drawn)
    mean_samples_ += static_cast<double>(counts[ray]) / static_cast<double>(drawn_count_);
  colours_ = uploaded(device, colours);
  backgrounds_ = uploaded(device, behind);
  masks_ = uploaded(device, masks);
  drawn_ = uploaded(device, drawn);
}

Value HumanRays::colours(Graph& graph) const {
  return table(graph, "person's colours", {DType::u8, {pool_.ray_count(), 3}}, colours_);
}
Value HumanRays::backgrounds(Graph& graph) const {
  return table(graph, "person's backgrounds", {DType::u8, {pool_.ray_count(), 3}}, backgrounds_);
}
Value HumanRays::masks(Graph& graph) const {
  return table(graph, "person's masks", {DType::u8, {pool_.ray_count(), 1}}, masks_);
}
Value HumanRays::drawn(Graph& graph) const {
  return table(graph, "person's drawn rays", {DType::i32, {drawn_count_}}, drawn_);
}

}  // namespace vivant
