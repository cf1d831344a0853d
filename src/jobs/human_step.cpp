#include "vivant/jobs/human_step.hpp"

#include <algorithm>

#include "vivant/model/human_losses.hpp"
#include "vivant/ops/attention.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/plane_variation.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/volume_render.hpp"

namespace vivant {
namespace {

enum Stream {
  draw_stream,
  jitter_stream,
  direction_stream,
  box_stream,
  line_stream,
  surface_stream,
  facing_stream
};

constexpr std::int64_t line_count = 32, surface_pair_count = 1024;
constexpr double fade_length = 0.1;  // part of the training over which the corrections fade in

/// 1 where a uniform random number is above a half, else 0.
Value coin(Value uniform) { return clamp(affine(uniform, 1e6, -0.5e6), 0, 1); }

}  // namespace

HumanStep::HumanStep(Device& device, const Config& config, ParameterStore& store, const HumanModel& model,
                     const HumanRays& rays, const CanonicalPoints& points, std::int64_t capacity)
    : config_(config), model_(model), rays_(rays), points_(points) {
  seed_ = graph_.scalar("seed", DType::i32);
  random_step_ = graph_.scalar("random step", DType::i32);
  fade_ = graph_.scalar("fade of the corrections");
  alpha_decay_ = graph_.scalar("decay of the alpha loss");
  const Value planes = model.field().planes(graph_);
  loss_of_rays(planes, capacity);
  loss_of_points(planes);
  if (planes && config.human.variation_weight > 0)
    add_term("variation", plane_variation(planes), config.human.variation_weight);
  std::vector<std::string> names;
  Values parameters;
  for (const ParameterStore::Parameter& parameter : store.parameters())
    if (parameter.name.starts_with("human.") && !parameter.name.starts_with("human.feature")) {
      names.push_back(parameter.name);
      parameters.push_back(store.value(graph_, parameter.name));
    }
  optimizer_ = std::make_unique<Optimizer>(
      device, graph_, store, names, differentiate(graph_, loss_, parameters), loss_,
      Optimizer::Options{.trained = names,
                         .groups = group_count,
                         .adam = {.beta1 = config.training.adam_beta1, .beta2 = config.training.adam_beta2},
                         .overflow = overflow_});
  Values outputs = {loss_, squared_error_};
  for (const auto& [name, term] : terms_) outputs.push_back(term);
  executor_ = std::make_unique<Executor>(device, graph_, outputs);
}

void HumanStep::add_term(const std::string& name, Value term, double weight) {
  terms_.emplace_back(name, term);
  const Value weighted = affine(term, weight);
  loss_ = loss_ ? add(loss_, weighted) : weighted;
}

void HumanStep::loss_of_rays(Value planes, std::int64_t capacity) {
  const auto& human = config_.human;
  const std::int64_t count = human.rays * human.batches_per_step, per_ray = rays_.samples().samples_per_ray();
  const Value rays = pick(rays_.drawn(graph_), count, key(draw_stream));
  const HumanSamples samples =
      gather_samples(rays_.samples().table(graph_), rays, random_uniform({count, 1}, key(jitter_stream)),
                     rays_.samples().step(), per_ray, capacity);
  overflow_ = samples.overflow;

  const Value coins = broadcast_channels(coin(random_uniform({count, 1}, key(direction_stream))), per_ray);
  // Ids beyond the count are undefined and must not be followed.
  const Value live_ids =
      graph_.with_count(graph_.reshape(samples.ids, {samples.ids.elements(), 1}), samples.points.count());
  const Value keep = gather_rows(graph_.reshape(coins, {count * per_ray, 1}), live_ids, IdOrder::ascending);
  FrameCodes codes = model_.codes(graph_);
  if (rays_.has_unseen_views()) codes = with_constant_copies(graph_, codes);
  const HumanFieldSamples field = model_.query(graph_, planes, samples, codes, fade_, keep);
  const RenderWeights weights = render_weights(field.density, field.deltas, field.depths);
  const Value alpha = sum_channels(weights.weight);
  const Value colour = model_.field().colour(
      graph_, weighted_sum(weights.weight, hidden_units(field.units), field.ids), alpha);

  const Value mask = image_gather(rays_.masks(graph_), rays),
              target = image_gather(rays_.colours(graph_), rays);
  const Value composite = over_background(colour, alpha, image_gather(rays_.backgrounds(graph_), rays));
  squared_error_ = l2_loss(composite, target);
  // On all rays, so that pixels beside the person count as well; or the paper's.
  add_term("colour",
           human.colour_loss == "composite" ? l1_loss(composite, target)
                                            : masked_colour_loss(colour, mask, target),
           1);
  if (human.mask_weight > 0) add_term("mask", l1_loss(alpha, mask), human.mask_weight);
  if (human.alpha_weight > 0)
    add_term("alpha", multiply(alpha_loss(alpha, mask), alpha_decay_), human.alpha_weight);
  if (human.smpl_weight > 0)
    add_term("smpl_rays",
             body_loss(field.row_density,
                       body_labels(samples.signed_distance, human.free_band, human.clothes_band),
                       human.smpl_length),
             human.smpl_weight);
  if (human.hard_weight > 0) add_term("hard", hard_loss(weights.weight), human.hard_weight);
  if (field.correction && human.correction_weight > 0)
    add_term("correction", l2_loss(field.correction, affine(graph_.detach(field.correction), 0)),
             human.correction_weight);
}

void HumanStep::loss_of_points(Value planes) {
  const auto& human = config_.human;
  if (human.smpl_weight > 0) {
    const CanonicalPoints::Points box = points_.box(graph_, human.box_points, key(box_stream));
    const Value density =
        model_.density(graph_, model_.features(graph_, planes, box.points), box.signed_distance);
    add_term("smpl_box",
             body_loss(density, body_labels(box.signed_distance, human.free_band, human.clothes_band),
                       human.smpl_length),
             human.smpl_weight);
  }
  if (human.edge_weight > 0) {
    const CanonicalPoints::Lines lines = points_.lines(graph_, line_count, key(line_stream));
    const Value features = model_.features(graph_, planes, lines.points.points);
    add_term("edge", edge_loss(model_.density(graph_, features, lines.points.signed_distance), lines.lengths),
             human.edge_weight);
  }
  if (human.smooth_weight > 0) {
    const CanonicalPoints::SurfacePairs pairs =
        points_.surface(graph_, surface_pair_count, key(surface_stream));
    const Value solid =
        graph_.constant({surface_pair_count, 1}, std::vector<double>(surface_pair_count, 1.0));
    // In some light, the same for both points of a pair.
    const Value corner = affine(random_uniform({surface_pair_count, 3}, key(facing_stream)), 2, -1);
    const Facing facing{.directions = {}, .normals = normalise_rows(corner)};
    const auto colour = [&](Value points) {
      return model_.field().colour(
          graph_, model_.hidden(graph_, model_.features(graph_, planes, points), facing), solid);
    };
    add_term("smooth", surface_colour_loss(colour(pairs.a), colour(pairs.b)), human.smooth_weight);
  }
}

void HumanStep::run(std::int64_t step) {
  const auto& human = config_.human;
  const double done = static_cast<double>(step) / static_cast<double>(std::max<std::int64_t>(1, human.steps));
  const RateSchedule schedule{.steps = human.steps,
                              .warmup = human.warmup_steps,
                              .decay = human.rate_decay,
                              .cooldown = human.cooldown};
  const auto rate = [&](double base) { return schedule.rate(base, step); };
  std::vector<double> rates(group_count, 0.0);
  rates[group_planes] =
      rate(model_.options().field.encoding == Encoding::vanilla ? human.plane_rate : human.unet_rate);
  rates[group_heads] = rate(human.head_rate);
  rates[group_codes] = rate(human.code_rate);
  executor_->set(seed_, static_cast<double>(config_.training.seed));
  executor_->set(random_step_, static_cast<double>(step));
  executor_->set(fade_, std::clamp((done - human.correction_start) / fade_length, 0.0, 1.0));
  executor_->set(alpha_decay_, 1 - done);
  optimizer_->set_step(*executor_, step + 1, rates);
  executor_->run();
}

double HumanStep::loss() { return executor_->read(loss_)[0]; }
double HumanStep::squared_error() { return executor_->read(squared_error_)[0]; }

std::map<std::string, double> HumanStep::terms() {
  std::map<std::string, double> values;
  for (const auto& [name, term] : terms_) values[name] = executor_->read(term)[0];
  return values;
}

}  // namespace vivant
