#include "vivant/model/human_sample_pool.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace vivant {
namespace {

using Eigen::Vector3d;

constexpr std::size_t record_bytes = sample_record_words * sizeof(std::int32_t);

template <typename T>
std::shared_ptr<Buffer> upload(Device& device, const std::vector<T>& data) {
  auto buffer = std::make_shared<Buffer>(device.allocate(data.size() * sizeof(T)));
  device.write(*buffer, data.data(), data.size() * sizeof(T));
  return buffer;
}

}  // namespace

HumanSamplePool::HumanSamplePool(Device& device, const BodyModel& body, const PoolOptions& options)
    : device_(device), body_(body), options_(options), graph_(std::make_unique<Graph>()) {
  const std::int64_t batch = options_.rays_per_batch;
  joint_transforms_ = graph_->input("joint_transforms", {body.body().joint_count(), 12});
  origins_ = graph_->input("origins", {batch, 3});
  directions_ = graph_->input("directions", {batch, 3});
  live_rays_ = graph_->scalar("live_rays", DType::i32);
  const BodyModel::Posed posed = body.pose(*graph_, joint_transforms_);
  traced_ = trace_samples(
      graph_->with_count(origins_, live_rays_), directions_, posed.mesh, posed.transforms,
      {.step = options.step, .threshold = options.threshold, .samples_per_ray = options.samples_per_ray});
  batch_records_ = std::make_shared<Buffer>(device.allocate(traced_.records.shape()[0] * record_bytes));
  graph_->place(graph_->value(graph_->root(traced_.records.id)), {batch_records_, 0});
  executor_ = std::make_unique<Executor>(device, *graph_, Values{traced_.records, traced_.offsets});
}

void HumanSamplePool::add_frame(int frame, const Pose& pose, const Vector3d& translation,
                                std::span<const Ray> rays) {
  if (!executor_) fail("[human_sample_pool] a frame was added to a pool that is finished");
  const auto transforms = joint_transforms(body_.body(), pose, translation);
  executor_->write(joint_transforms_, std::span<const double>(transform_rows(transforms)));
  const Eigen::Matrix3d to_root = transforms[0].leftCols<3>().transpose();
  const Vector3d root = transforms[0] * body_.body().joints[0].homogeneous();
  const std::size_t batch = static_cast<std::size_t>(options_.rays_per_batch);
  for (std::size_t first = 0; first < rays.size(); first += batch) {
    const std::size_t live = std::min(batch, rays.size() - first);
    std::vector<float> origins(3 * batch, 0.0f), directions(3 * batch, 0.0f);
    for (std::size_t r = 0; r < live; ++r) {
      const Ray& ray = rays[first + r];
      const Vector3d root_origin = to_root * (ray.origin - root), root_direction = to_root * ray.direction;
      for (int axis = 0; axis < 3; ++axis) {
        origins[3 * r + axis] = static_cast<float>(ray.origin[axis]);
        directions[3 * r + axis] = static_cast<float>(ray.direction[axis]);
      }
      for (double x : {root_origin.x(), root_origin.y(), root_origin.z(), root_direction.x(),
                       root_direction.y(), root_direction.z()})
        roots_.push_back(static_cast<float>(x));
    }
    executor_->write(origins_, std::span<const float>(origins));
    executor_->write(directions_, std::span<const float>(directions));
    executor_->set(live_rays_, static_cast<double>(live));
    executor_->run();
    const std::vector<std::int32_t> batch_offsets = executor_->read_ints(traced_.offsets);
    keep(*batch_records_, batch_offsets[live]);
    const std::int32_t before = offsets_.back();
    for (std::size_t r = 1; r <= live; ++r) offsets_.push_back(before + batch_offsets[r]);
    frames_.insert(frames_.end(), live, frame);
  }
}

void HumanSamplePool::keep(const Buffer& records, std::int64_t count) {
  const std::uint64_t most =
      std::min<std::uint64_t>(options_.largest_bytes, device_.info().largest_buffer_bytes);
  if ((static_cast<std::uint64_t>(sample_count()) + count) * record_bytes > most)
    fail(
        "[human_sample_pool] the samples near the body take more than {} MiB: trace fewer frames or use a "
        "larger "
        "step "
        "than {} m",
        most >> 20, options_.step);
  if (count == 0) return;
  chunks_.push_back(device_.allocate(count * record_bytes));
  device_.copy(records, 0, chunks_.back(), 0, count * record_bytes);
}

void HumanSamplePool::finish() {
  if (frames_.empty()) fail("[human_sample_pool] there are no rays");
  executor_.reset();
  batch_records_.reset();
  graph_.reset();
  records_ =
      std::make_shared<Buffer>(device_.allocate(std::max<std::size_t>(sample_count(), 1) * record_bytes));
  std::size_t at = 0;
  for (Buffer& chunk : chunks_) {
    device_.copy(chunk, 0, *records_, at, chunk.bytes());
    device_.finish();
    at += chunk.bytes();
    chunk = Buffer();  // so that the peak stays near the final size
  }
  chunks_.clear();
  offset_table_ = upload(device_, offsets_);
  frame_table_ = upload(device_, frames_);
  root_table_ = upload(device_, roots_);
}

std::vector<int> HumanSamplePool::ray_sample_counts() const {
  std::vector<int> counts;
  for (std::size_t r = 0; r + 1 < offsets_.size(); ++r) counts.push_back(offsets_[r + 1] - offsets_[r]);
  return counts;
}

std::int64_t HumanSamplePool::samples_per_ray() const {
  int most = 1;
  for (int count : ray_sample_counts()) most = std::max(most, count);
  return most;
}

std::uint64_t HumanSamplePool::bytes() const {
  return static_cast<std::uint64_t>(sample_count()) * record_bytes + (offsets_.size() + frames_.size()) * 4 +
         roots_.size() * sizeof(float);
}

SampleTable HumanSamplePool::table(Graph& graph) const {
  if (!records_) fail("[human_sample_pool] the pool is not finished");
  const std::int64_t records = std::max<std::int64_t>(sample_count(), 1);
  return {graph.external("sample_records", {DType::i32, {records, sample_record_words}}, {records_, 0}),
          graph.external("sample_offsets", {DType::i32, {ray_count() + 1, 1}}, {offset_table_, 0}),
          graph.external("sample_frames", {DType::i32, {ray_count(), 1}}, {frame_table_, 0}),
          graph.external("sample_roots", {DType::real, {ray_count(), 6}}, {root_table_, 0})};
}

}  // namespace vivant
