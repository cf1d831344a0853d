#pragma once
#include <memory>
#include <span>
#include <vector>

#include "vivant/graph/executor.hpp"
#include "vivant/model/body_model.hpp"
#include "vivant/ops/human_samples.hpp"

namespace vivant {

struct PoolOptions {
  double step = 0.015;                  ///< metres between samples
  double threshold = 0.12;              ///< metres: samples farther from the posed body are left out
  std::int64_t samples_per_ray = 128;   ///< the most of one ray
  std::int64_t rays_per_batch = 16384;  ///< rays that are traced at a time
  /// The most memory of the records, 36 bytes a sample; at most what the device allows for one buffer.
  std::uint64_t largest_bytes = std::uint64_t{3} << 29;
};

/// The samples near the body of many rays of many frames, traced once and kept on the device: with fixed
/// poses they are constants of the training. Add the frames, then `finish`, then use `table` in any number of
/// graphs.
class HumanSamplePool {
 public:
  HumanSamplePool(Device& device, const BodyModel& body, const PoolOptions& options = {});

  /// Traces the rays of one frame; their indices in the table follow those of the frames before. `frame` is
  /// what HumanSamples::frame says of them. Throws Error when the pool grows too large.
  void add_frame(int frame, const Pose& pose, const Eigen::Vector3d& translation, std::span<const Ray> rays);
  /// Joins the frames into one table; no frame can be added after it. Throws Error when there are no rays.
  void finish();

  std::int64_t ray_count() const { return static_cast<std::int64_t>(frames_.size()); }
  std::int64_t sample_count() const { return offsets_.back(); }
  /// The most samples of a ray, at least 1: the S that gather_samples needs.
  std::int64_t samples_per_ray() const;
  /// Number of samples of each ray.
  std::vector<int> ray_sample_counts() const;
  double step() const { return options_.step; }
  std::uint64_t bytes() const;

  SampleTable table(Graph& graph) const;

 private:
  void keep(const Buffer& records, std::int64_t count);

  Device& device_;
  const BodyModel& body_;
  PoolOptions options_;
  std::unique_ptr<Graph> graph_;  // traces one batch
  Value joint_transforms_, origins_, directions_, live_rays_;
  TracedSamples traced_;
  std::shared_ptr<Buffer> batch_records_;
  std::unique_ptr<Executor> executor_;

  std::vector<Buffer> chunks_;  // records of the batches so far
  std::vector<std::int32_t> offsets_ = {0}, frames_;
  std::vector<float> roots_;
  std::shared_ptr<Buffer> records_, offset_table_, frame_table_, root_table_;
};

}  // namespace vivant
