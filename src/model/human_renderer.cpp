#include "vivant/model/human_renderer.hpp"

#include <algorithm>
#include <numeric>

#include "vivant/data/camera_table.hpp"
#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/linear.hpp"
#include "vivant/ops/peak_depth.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {

PersonState captured_state(const HumanModel& model, const Capture& capture, int frame) {
  const int body_frame = capture.frames.at(frame).body_frame;
  if (!capture.human || body_frame < 0)
    fail("{}: the frame {} shows no person", capture.source.string(), capture.frames[frame].name);
  const Motion& poses = capture.human->poses;
  return {poses.pose[body_frame], poses.translation[body_frame],
          model.mixed_codes(capture.training_rows(frame))};
}

PersonState novel_state(const Motion& motion, int frame, const HumanModel::CodeRow& codes) {
  return {motion.pose.at(frame), motion.translation.at(frame), codes};
}

void PersonView::draw_over(cv::Mat& picture) const {
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * window.width + x;
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(window.y + y, window.x + x);
      for (int c = 0; c < 3; ++c)
        pixel[c] = cv::saturate_cast<std::uint8_t>(255 * pixels[3 * i + c] + (1 - alpha[i]) * pixel[c]);
    }
}

PersonInputs::PersonInputs(Graph& graph, const HumanModel& model)
    : model_(model), joints_(graph.input("joint transforms", {model.body().body().joint_count(), 12})) {
  const HumanOptions& options = model.options();
  if (options.error_correction) codes_.error = graph.input("error code", {1, options.error_codes});
  if (options.bone_corrections)
    codes_.bones = graph.input("bone code", {1, model.body().body().joint_count(), 6});
}

HumanFieldSamples PersonInputs::sample(Graph& graph, Value planes, const Rays& rays,
                                       const TraceOptions& trace, std::int64_t capacity, bool view_direction,
                                       Output output, const Eigen::Matrix3d& light) {
  const BodyModel::Posed posed = model_.body().pose(graph, joints_);
  const TracedSamples traced =
      trace_samples(rays.origins, rays.directions, posed.mesh, posed.transforms, trace);
  const std::int64_t count = rays.origins.shape()[0];
  std::vector<std::int32_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  const SampleTable table{.records = traced.records,
                          .offsets = traced.offsets,
                          .frames = {},
                          .roots = model_.body().root_rays(rays.origins, rays.directions, joints_)};
  HumanSamples samples = gather_samples(table, graph.constant({count}, std::span<const std::int32_t>(all)),
                                        {}, trace.step, trace.samples_per_ray, capacity);
  overflow_ = samples.overflow;
  if (!view_direction) samples.directions = {};
  if (!light.isIdentity())  // stored by columns: the weight of a row
    samples.normals = linear(samples.normals, graph.constant({3, 3}, std::span(light.data(), 9)));
  const Value one = graph.constant({1}, std::vector<double>{1});
  return model_.query(graph, planes, samples, codes_, one, {}, output);
}

void PersonInputs::write(Executor& executor, const PersonState& state) const {
  const std::vector<double> rows =
      transform_rows(joint_transforms(model_.body().body(), state.pose, state.translation));
  executor.write(joints_, std::span<const double>(rows));
  if (codes_.error) executor.write(codes_.error, std::span<const float>(state.codes.error));
  if (codes_.bones) executor.write(codes_.bones, std::span<const float>(state.codes.bones));
}

namespace {

/// The camera of a world of `units` in a metre, in metres.
Camera metric(Camera camera, double units) {
  camera.world_to_camera.topRightCorner<3, 1>() /= units;
  return camera;
}

Rays metric(const Rays& rays, double units) {
  return units == 1 ? rays : Rays{affine(rays.origins, 1 / units), rays.directions};
}

/// The samples of a person, lengths in another unit than metres.
HumanFieldSamples in_units(HumanFieldSamples samples, double units) {
  if (units == 1) return samples;
  samples.depths = affine(samples.depths, units);
  samples.deltas = affine(samples.deltas, units);
  samples.density = affine(samples.density, 1 / units);
  return samples;
}

}  // namespace

HumanRenderer::HumanRenderer(Device& device, const HumanModel& model, const Options& options)
    : device_(device), model_(model), options_(options), planes_(device, model.field()) {
  if (options.scene) {
    // Merged intervals are shorter than the scene's own, by which samples would be left out.
    const bool own = options.intervals == Intervals::own;
    scene_.emplace(device, *options.scene, own ? options.weight_threshold : 0);
  }
}

void HumanRenderer::build(int width, int height) {
  executor_.reset();
  width_ = width;
  height_ = height;
  tile_ = std::min<std::int64_t>(options_.tile_rays, static_cast<std::int64_t>(width) * height);
  graph_ = std::make_unique<Graph>();
  Graph& graph = *graph_;
  camera_ = graph.input("camera", {1, camera_table_columns});
  pixels_ = graph.input("pixels", {tile_}, DType::i32);
  person_ = std::make_unique<PersonInputs>(graph, model_);
  const Rays rays = ray_generation(camera_, pixels_, width, height);
  const double units = options_.units_per_metre;
  const HumanFieldSamples samples = in_units(
      person_->sample(
          graph, planes_.value(graph), metric(rays, units),
          {.step = options_.step, .threshold = options_.threshold, .samples_per_ray = samples_per_ray},
          room_ * tile_, options_.view_direction, options_.output, options_.light),
      units);
  if (options_.scene) {
    const SceneModel& scene = *options_.scene;
    const FieldSamples behind = scene_->sample(graph, rays, options_.output);
    const CompositeRays both =
        composite(graph, behind, samples, options_.intervals, options_.weight_threshold);
    output_ = composite_output(graph, scene, model_, both, options_.output);
    alpha_ = both.human_alpha;
    opacity_ = add(both.scene_alpha, both.human_alpha);
    depth_ = both.human_depth;
    scene_depth_ = both.scene_depth;
  } else {
    const RenderWeights weights = render_weights(samples.density, samples.deltas, samples.depths);
    opacity_ = alpha_ = sum_channels(weights.weight);
    depth_ = peak_depth(weights.weight, samples.depths);
    output_ = model_.field().output(graph, options_.output,
                                    rendered_units(samples.units, weights.weight, options_.weight_threshold),
                                    alpha_);
  }
  Values outputs = {output_, alpha_, opacity_, depth_, person_->overflow()};
  if (options_.scene) outputs.push_back(scene_depth_);
  executor_ = std::make_unique<Executor>(device_, graph, outputs);
}

PersonView HumanRenderer::render(const Camera& camera, const PersonState& state) {
  if (!executor_ || width_ != camera.width || height_ != camera.height) build(camera.width, camera.height);
  const Body& body = model_.body().body();
  PersonView view;
  view.window = visible_window(metric(camera, options_.units_per_metre),
                               posed_vertices(body, state.pose, state.translation), options_.threshold);
  if (view.window.empty()) return view;
  std::vector<std::int32_t> pixels;
  for (int y = view.window.y; y < view.window.y + view.window.height; ++y)
    for (int x = view.window.x; x < view.window.x + view.window.width; ++x)
      pixels.push_back(y * camera.width + x);
  const auto channels = static_cast<std::size_t>(output_.shape().channels());
  view.pixels.resize(channels * pixels.size());
  view.alpha.resize(pixels.size());
  view.opacity.resize(pixels.size());
  view.depth.resize(pixels.size());
  std::vector<float> scene_depth(options_.scene ? pixels.size() : 0);
  const auto prepare = [&] {
    executor_->write(camera_, std::span<const float>(camera_table(std::span(&camera, 1))));
    person_->write(*executor_, state);
  };
  prepare();
  const auto tile = static_cast<std::size_t>(tile_);
  for (std::size_t first = 0; first < pixels.size();) {
    std::vector<std::int32_t> ids(tile);
    for (std::size_t i = 0; i < tile; ++i) ids[i] = pixels[std::min(first + i, pixels.size() - 1)];
    executor_->write(pixels_, std::span<const std::int32_t>(ids));
    executor_->run();
    if (executor_->read_ints(person_->overflow())[0] != 0) {  // once more with room for more samples
      room_ = std::min(2 * room_, samples_per_ray);
      build(camera.width, camera.height);
      prepare();
      continue;
    }
    const std::size_t count = std::min(tile, pixels.size() - first);
    const auto copy = [&](Value value, std::vector<float>& to, std::size_t channels) {
      const std::vector<float> data = executor_->read(value);
      std::copy_n(data.begin(), count * channels, to.begin() + static_cast<std::ptrdiff_t>(first * channels));
    };
    copy(output_, view.pixels, channels);
    copy(alpha_, view.alpha, 1);
    copy(opacity_, view.opacity, 1);
    copy(depth_, view.depth, 1);
    if (options_.scene) copy(scene_depth_, scene_depth, 1);
    first += count;
  }
  for (std::size_t i = 0; i < scene_depth.size(); ++i)
    if (!(view.alpha[i] > 0.5f)) view.depth[i] = scene_depth[i];
  return view;
}

}  // namespace vivant
