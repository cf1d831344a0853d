#include "vivant/model/human_rays.hpp"

#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "vivant/model/unseen_surface.hpp"

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

/// What the rays should see.
struct Targets {
  std::vector<std::uint8_t> colours, backgrounds, masks;
  std::vector<std::int32_t> on_mask;  ///< rays of which most is the person's

  void add(const cv::Vec3b& colour, const cv::Vec3b& background, std::uint8_t mask) {
    masks.push_back(mask);
    for (int c = 0; c < 3; ++c) {
      colours.push_back(colour[c]);
      backgrounds.push_back(background[c]);
    }
  }
};

/// The rays of a box around the person in a frame.
std::vector<Ray> captured_rays(const Body& body, const Capture& capture, int index, const cv::Mat& background,
                               const HumanRayOptions& options, Targets& targets) {
  const CaptureFrame& frame = capture.frames[index];
  if (frame.body_frame < 0) fail("{}: the frame {} has no body_frame", capture.source.string(), frame.name);
  const cv::Mat image = capture.image(index), stored = capture.soft_mask(index), mask = stored > 127,
                coverage = softened(stored, options.mask_softness * image.rows);
  if (background.type() != CV_8UC3 || background.size() != image.size())
    fail("the background of {} is no RGB picture of {}x{} pixels", frame.name, image.cols, image.rows);
  const cv::Rect box =
      person_box(mask, frame.camera, posed_vertices(body, capture.human->poses, frame.body_frame),
                 static_cast<int>(std::lround(options.border * image.rows)));
  std::vector<Ray> rays;
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x) {
      if (mask.at<std::uint8_t>(y, x) != 0)
        targets.on_mask.push_back(static_cast<std::int32_t>(targets.masks.size()));
      targets.add(image.at<cv::Vec3b>(y, x), background.at<cv::Vec3b>(y, x), coverage.at<std::uint8_t>(y, x));
      rays.push_back(frame.camera.ray({x + 0.5, y + 0.5}));
    }
  return rays;
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
  const auto add_rays = [&](std::size_t row, std::size_t codes, const std::vector<Ray>& rays) {
    const Motion& poses = capture.human->poses;
    const int pose = capture.frames[frames[row]].body_frame;
    pool_.add_frame(static_cast<int>(codes), poses.pose[pose], poses.translation[pose], rays);
  };
  Targets targets;
  for (std::size_t row = 0; row < frames.size(); ++row)
    add_rays(row, row,
             captured_rays(body.body(), capture, frames[row], backgrounds.at(row), options, targets));
  if (targets.on_mask.empty()) fail("{}: the masks show no person", capture.source.string());
  const std::size_t captured = targets.masks.size();
  for (const UnseenView& view :
       unseen_views(body.body(), capture, frames, options.unseen_views, options.mask_softness)) {
    for (const cv::Vec3b& colour : view.colours) targets.add(colour, colour, 255);
    add_rays(view.row, frames.size() + view.row, view.rays);
    has_unseen_views_ = true;
  }
  pool_.finish();
  std::vector<std::int32_t> drawn(targets.masks.size());
  std::iota(drawn.begin(), drawn.end(), 0);
  for (std::size_t i = 0; i < captured; ++i) drawn.push_back(targets.on_mask[i % targets.on_mask.size()]);
  drawn_count_ = static_cast<std::int64_t>(drawn.size());
  const std::vector<int> counts = pool_.ray_sample_counts();
  for (const std::int32_t ray : drawn)
    mean_samples_ += static_cast<double>(counts[ray]) / static_cast<double>(drawn_count_);
  colours_ = uploaded(device, targets.colours);
  backgrounds_ = uploaded(device, targets.backgrounds);
  masks_ = uploaded(device, targets.masks);
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
