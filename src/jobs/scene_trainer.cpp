#include "vivant/jobs/scene_trainer.hpp"

#include "vivant/io/image.hpp"
#include "vivant/jobs/psnr.hpp"
#include "vivant/model/view_renderer.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/plane_variation.hpp"
#include "vivant/ops/random.hpp"
#include "vivant/ops/ray_distortion.hpp"
#include "vivant/ops/reduction.hpp"

namespace vivant {
namespace {

/// Part of the training after which cameras and exposures are corrected: a scene that is not there yet would
/// push them anywhere.
constexpr double corrections_from = 0.1;
/// Of the mean square of the exposures: just enough to hold the brightness of all of them.
constexpr double exposure_weight = 0.01;

/// The planes' size at a step: a quarter of the way each at a quarter and at half of the final size.
std::int64_t plane_size_at(const Config& config, const SceneModel& model, std::int64_t step) {
  const FieldOptions& options = model.field().options();
  const bool fixed = options.encoding == Encoding::vanilla || options.encoding == Encoding::mlp;
  const std::int64_t smallest = std::min<std::int64_t>(64, options.plane_size);
  if (fixed || !config.scene.grow_planes) return options.plane_size;
  const double done = static_cast<double>(step) / static_cast<double>(config.scene.steps);
  const std::int64_t divisor = done < 0.25 ? 4 : done < 0.5 ? 2 : 1;
  return std::max(smallest, options.plane_size / divisor);
}

/// Adds to a sum, which may be absent: zero. A gradient may be absent, too.
void add_to(Value& sum, Value term) {
  if (term) sum = sum ? add(sum, term) : term;
}

}  // namespace

SceneTrainer::SceneTrainer(Device& device, const Config& config, const Capture& capture,
                           const DeviceCapture& data, CaptureModel& model)
    : device_(device),
      config_(config),
      capture_(capture),
      data_(data),
      trained_(model),
      store_(model.store()),
      model_(model.scene()),
      cameras_(model.camera_refinement()),
      exposures_(model.exposure_correction()) {
  const std::vector<std::int32_t> pixels =
      background_pixels(capture, data.frames(), config.scene.mask_dilation);
  pixel_count_ = static_cast<std::int64_t>(pixels.size());
  const auto on_device = [&](const std::vector<std::int32_t>& list) {
    auto buffer = std::make_shared<Buffer>(device.allocate(list.size() * sizeof(std::int32_t)));
    device.write(*buffer, list.data(), list.size() * sizeof(std::int32_t));
    return buffer;
  };
  pixels_ = on_device(pixels);
  if (!exposures_) return;
  std::vector<std::int32_t> frames(pixels);
  for (std::int32_t& pixel : frames) pixel /= data.width() * data.height();
  pixel_frames_ = on_device(frames);
}

Value SceneTrainer::drawn(Graph& graph, const std::string& name, const std::shared_ptr<Buffer>& list,
                          const RandomKey& key) {
  const Value all = graph.named(name, [&] {
    return graph.external(name, {DType::i32, {pixel_count_}}, {list, 0});
  });
  return pick(all, config_.scene.rays, key);
}

Value SceneTrainer::batch_loss(Graph& graph, Value planes, int batch) {
  const Graph::Scope scope(graph, fmt::format("batch{}", batch));
  const RandomKey pixels_key{phase().seed, phase().step, 3 * batch},
      jitter_key{phase().seed, phase().step, 3 * batch + 1};
  const Value ids = drawn(graph, "background pixels", pixels_, pixels_key);
  Rays rays = ray_generation(data_.cameras(graph), ids, data_.width(), data_.height());
  if (cameras_)
    rays = cameras_->corrected(graph, rays, ids, static_cast<std::int64_t>(data_.width()) * data_.height());
  const FieldSamples samples = model_.sample(graph, planes, rays, &jitter_key);
  const RenderedRays rendered = model_.render(graph, samples, config_.scene.weight_threshold);
  Value colour = model_.field().colour(graph, rendered.hidden, rendered.alpha);
  if (exposures_)
    colour = exposures_->exposed(graph, colour, drawn(graph, "background frames", pixel_frames_, pixels_key));
  const Value error = l2_loss(colour, image_gather(data_.images(graph), ids));
  const double share = 1.0 / static_cast<double>(config_.scene.batches_per_step);
  add_to(phase().squared_error, affine(error, share));
  Value loss = error;
  if (config_.scene.distortion_weight > 0)
    loss = add(loss, affine(mean(ray_distortion(rendered.weight, samples.depths, samples.range.near,
                                                samples.range.far, model_.spacing())),
                            config_.scene.distortion_weight));
  if (cameras_)
    loss = add(loss, affine(phase().corrections["camera_correction"], config_.scene.camera_weight));
  if (exposures_) loss = add(loss, affine(phase().corrections["exposure_correction"], exposure_weight));
  return affine(loss, share);
}

void SceneTrainer::begin_phase(std::int64_t step) {
  phase_ = std::make_unique<Phase>();
  phase().plane_size = plane_size_at(config_, model_, step);
  Graph& graph = phase().graph;
  phase().seed = graph.scalar("seed", DType::i32);
  phase().step = graph.scalar("random step", DType::i32);
  std::vector<std::string> plane_names, head_names;
  for (const ParameterStore::Parameter& parameter : store_.parameters()) {
    if (!parameter.name.starts_with("scene.") || parameter.name.starts_with("scene.feature")) continue;
    (parameter.group == group_planes ? plane_names : head_names).push_back(parameter.name);
  }
  const auto values = [&](const std::vector<std::string>& names) {
    Values result;
    for (const std::string& name : names) result.push_back(store_.value(graph, name));
    return result;
  };
  // The ray batches' gradients gather on the planes; the U-Nets' backward pass then runs once.
  const Value planes = model_.field().planes(graph, phase().plane_size);
  Values wrt = values(head_names);
  if (planes) wrt.push_back(planes);
  Values sums(wrt.size());
  if (cameras_) phase().corrections["camera_correction"] = cameras_->mean_square(graph);
  if (exposures_) phase().corrections["exposure_correction"] = exposures_->mean_square(graph);
  const auto add_loss = [&](Value loss) {
    const Values gradients = differentiate(graph, loss, wrt);
    for (std::size_t i = 0; i < wrt.size(); ++i) add_to(sums[i], gradients[i]);
    add_to(phase().loss, loss);
  };
  for (int batch = 0; batch < static_cast<int>(config_.scene.batches_per_step); ++batch)
    add_loss(batch_loss(graph, planes, batch));
  if (planes && config_.scene.variation_weight > 0)
    add_loss(affine(plane_variation(planes), config_.scene.variation_weight));
  std::vector<std::string> names = head_names;
  if (planes) {
    const Value seed = sums.back();
    sums.pop_back();
    const Values plane_gradients = differentiate(graph, {planes}, {seed}, values(plane_names));
    sums.insert(sums.end(), plane_gradients.begin(), plane_gradients.end());
    names.insert(names.end(), plane_names.begin(), plane_names.end());
  }
  phase().optimizer = std::make_unique<Optimizer>(
      device_, graph, store_, names, sums, phase().loss,
      Optimizer::Options{
          .trained = names,
          .groups = group_count,
          .adam = {.beta1 = config_.training.adam_beta1, .beta2 = config_.training.adam_beta2}});
  Values outputs = {phase().loss, phase().squared_error};
  for (const auto& [name, mean_square] : phase().corrections) outputs.push_back(mean_square);
  phase().executor = std::make_unique<Executor>(device_, graph, outputs);
}

void SceneTrainer::run(std::int64_t step) {
  const bool grows = phase_ && plane_size_at(config_, model_, step) != phase().plane_size;
  if (!phase_ || (grows && !failure())) begin_phase(step);  // a failure stays until it is asked for
  const auto& scene = config_.scene;
  const RateSchedule schedule{.steps = scene.steps,
                              .warmup = scene.warmup_steps,
                              .decay = scene.rate_decay,
                              .cooldown = scene.cooldown};
  const auto rate = [&](double base) { return schedule.rate(base, step); };
  std::vector<double> rates(group_count, 0.0);
  rates[group_planes] =
      rate(model_.field().options().encoding == Encoding::vanilla ? scene.plane_rate : scene.unet_rate);
  rates[group_heads] = rate(scene.head_rate);
  if (static_cast<double>(step) >= corrections_from * static_cast<double>(scene.steps)) {
    rates[group_cameras] = rate(scene.camera_rate);
    rates[group_exposures] = rate(scene.exposure_rate);
  }
  if (reported_step_ < 0) reported_step_ = step;
  Executor& executor = *phase().executor;
  executor.set(phase().seed, static_cast<double>(config_.training.seed));
  executor.set(phase().step, static_cast<double>(step));
  phase().optimizer->set_step(executor, step + 1, rates);
  executor.run();
}

StepReport SceneTrainer::report(std::int64_t step) {
  StepReport report;
  report.step = step;
  report.loss = phase().executor->read(phase().loss)[0];
  report.psnr = psnr_of(phase().executor->read(phase().squared_error)[0]);
  for (const auto& [name, mean_square] : phase().corrections)
    report.more[name] = std::sqrt(phase().executor->read(mean_square)[0]);
  report.rays =
      static_cast<double>((step - reported_step_) * config_.scene.rays * config_.scene.batches_per_step);
  reported_step_ = step;
  return report;
}

std::optional<TrainingFailure> SceneTrainer::failure() {
  return phase().optimizer->failure(*phase().executor);
}

void SceneTrainer::diagnose(std::int64_t step) {
  run(step);
  phase().executor->run_checked();
}

void SceneTrainer::preview(const std::filesystem::path& folder, const std::string& stem) {
  SceneRenderer renderer(device_, model_, {});
  const std::vector<int> held_out = capture_.held_out_frames();
  const Capture corrected = trained_.corrected(capture_);
  const CaptureFrame& frame = corrected.frames[held_out.empty() ? 0 : held_out.front()];
  write_image(folder / (stem + ".png"), renderer.render(frame.camera).rgb8());
}

}  // namespace vivant
