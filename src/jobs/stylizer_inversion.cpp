// Inversion training: psi and the decoder turn features back into the picture.
#include <opencv2/imgproc.hpp>
#include "jobs/stylizer_training.hpp"
#include "jobs/vgg_measurement.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/psnr.hpp"
#include "vivant/model/read_out.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/reduction.hpp"
#include "vivant/ops/resample.hpp"

namespace vivant {
namespace {

constexpr int short_side = 320, least_side = 128;  // of the pictures trained on
constexpr int measured_crops = 40, measured_side = 128, crop_side = 96;
constexpr int every = 3;  // of the measured features goes into the least squares
// Rendered features are blurred and noisy, so some of the training's are. The baselines see neither noise nor
// blur.
constexpr double recolour = 0.3, without_detail = 0.3, soft_picture = 0.2, noisy = 0.35, blurred = 0.35;
constexpr double most_noise = 0.6, most_blur = 1.2;  // standard deviations of the features; pixels

/// The crop at a quarter of its size, as the mean of 4x4 pixels.
cv::Mat quarter(const cv::Mat& picture) {
  cv::Mat small;
  cv::resize(picture, small, picture.size() / 4, 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

StylizerTraining::StylizerTraining(Device& device, const PretrainStylizerOptions& options)
    : device(device),
      seed(options.seed),
      photographs(options.photographs, short_side, least_side, options.unseen),
      paintings(options.paintings, short_side, least_side, options.unseen),
      unseen(pictures_called(options.paintings, options.unseen, short_side)),
      initializer(options.seed),
      stylizer(store, initializer, StylizerOptions::of_form(options.form)),
      vgg(device),
      weights{.global = options.global_weight} {
  store.allocate(device);
}

cv::Mat StylizerTraining::crop(KeyedRandom& random, int side, double recolour, double painted) const {
  return (random.chance(painted) ? paintings : photographs).crop(random, side, recolour);
}

double measure_pictures(StylizerTraining& training, bool start) {
  VggMeasurement measurement(training.device, training.vgg, measured_side);
  std::vector<float> samples, colours;
  for (int i = 0; i < measured_crops; ++i) {
    KeyedRandom random(training.seed, "measure", i);
    const cv::Mat crop = training.crop(random, measured_side, recolour, i % 2);
    const std::vector<float> all = measurement.add(crop);
    if (!start) continue;
    const cv::Mat small = quarter(crop);
    for (std::size_t place = 0; place < small.total(); place += every) {
      samples.insert(samples.end(), all.begin() + place * Stylizer::features,
                     all.begin() + (place + 1) * Stylizer::features);
      const auto colour = floats_of(small).subspan(3 * place, 3);
      colours.insert(colours.end(), colour.begin(), colour.end());
    }
  }
  training.scales = measurement.scales();
  for (const double variance : measurement.variance(2))
    training.feature_deviation.push_back(static_cast<float>(std::sqrt(variance)));
  if (!start) return 0;
  return psnr_of(start_read_out(training.store, training.stylizer, training.initializer, samples, colours));
}

InversionStep::InversionStep(StylizerTraining& training, double loss_weight) : training_(training) {
  const Stylizer& stylizer = training.stylizer;
  constexpr std::int64_t side = crop_side, small = side / Stylizer::scale;
  sharp_ = graph_.input("sharp", {side, side, 3});
  rendered_ = graph_.input("rendered", {side, side, 3});
  noise_ = graph_.input("noise", {small, small, Stylizer::features});
  noise_amount_ = graph_.scalar("noise amount");
  blur_amount_ = graph_.scalar("blur amount");
  detail_amount_ = graph_.scalar("detail amount");
  const StyleFeatures goal = style_features(training.vgg, sharp_, 3);
  const Value seen = goal[2];
  const Value soft = blend(seen, gaussian_blur(seen, 1), blur_amount_);
  const Value deviation = graph_.constant({Stylizer::features}, training.feature_deviation);
  const Value features = add(soft, multiply(multiply(noise_, deviation), noise_amount_));
  const Value detail = stylizer.options().detail
                           ? multiply(stylizer.detail(stylizer.luma(graph_, rendered_)), detail_amount_)
                           : Value{};
  const Value image = stylizer.decode_image(graph_, stylizer.content(graph_, features), detail);
  const Value loss =
      affine(reconstruction_loss(image, sharp_, style_features(training.vgg, image, 3), goal), loss_weight);
  error_ = l2_loss(image, sharp_);
  optimizer_ = optimise(training.device, graph_, training.store, loss, decoding_parts(training.stylizer));
  executor_ = std::make_unique<Executor>(training.device, graph_, Values{error_});
  noise_values_.resize(noise_.elements());
  executor_->write(noise_, noise_values_);  // 0 times what was never written need not be 0
}

void InversionStep::run(std::int64_t step, std::int64_t optimizer_step, double rate) {
  KeyedRandom random(training_.seed, "inversion", step);
  const cv::Mat sharp = training_.crop(random, crop_side, recolour);
  cv::Mat rendered = sharp;
  if (random.chance(soft_picture)) cv::GaussianBlur(sharp, rendered, {}, random.uniform(0.4, most_blur));
  executor_->write(sharp_, floats_of(sharp));
  executor_->write(rendered_, floats_of(rendered));
  const bool rendered_features = !training_.stylizer.options().mirrored;
  const bool noise = rendered_features && random.chance(noisy);
  if (noise) {
    random.fill_normal(noise_values_, 1);
    executor_->write(noise_, noise_values_);
  }
  executor_->set(noise_amount_, noise ? random.uniform(0, most_noise) : 0);
  executor_->set(blur_amount_, rendered_features && random.chance(blurred) ? random.uniform() : 0);
  executor_->set(detail_amount_, random.chance(without_detail) ? 0 : 1);
  optimizer_->set_step(*executor_, optimizer_step, {rate});
  executor_->run();
}

double InversionStep::error() { return executor_->read(error_)[0]; }

}  // namespace vivant
