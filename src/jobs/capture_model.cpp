#include "vivant/jobs/capture_model.hpp"

#include "vivant/io/safetensors.hpp"
#include "vivant/jobs/stylise_pictures.hpp"

namespace vivant {
namespace {

FieldOptions scene_field_options(const Config& config, const SceneSpace& space) {
  const auto& scene = config.scene;
  FieldOptions options;
  options.encoding = encoding_from(scene.planes);
  options.combine = combine_from(scene.combine);
  options.gradient_copies = static_cast<int>(config.training.gradient_copies);
  options.plane_size = scene.plane_size;
  options.channels = scene.plane_channels;
  options.scales = static_cast<int>(scene.plane_scales);
  options.unet_widths = scene.unet_widths;
  options.position_frequencies = static_cast<int>(scene.position_frequencies);
  options.direction_frequencies = static_cast<int>(scene.direction_frequencies);
  options.density_activation = activation_from(scene.density);
  options.feature_hidden = config.features.hidden == "trained";
  if (space.shell) {
    // A thin shell is a panorama: planes optimised directly and no view dependence (measured: 25.0 dB
    // against 22.6).
    options.encoding = Encoding::vanilla;
    options.plane_size = scene.shell_plane_size;
    options.scales = 1;
    options.direction_frequencies = 0;
  }
  return options;
}

HumanOptions human_options(const Config& config, bool exact_poses) {
  const auto& human = config.human;
  HumanOptions options;
  options.field.encoding = encoding_from(human.planes);
  options.field.combine = combine_from(human.combine);
  options.field.gradient_copies = static_cast<int>(config.training.gradient_copies);
  options.field.plane_size = human.plane_size;
  options.field.channels = human.plane_channels;
  options.field.scales = static_cast<int>(human.plane_scales);
  options.field.unet_widths = human.unet_widths;
  options.field.position_frequencies = static_cast<int>(human.position_frequencies);
  options.field.direction_frequencies = static_cast<int>(human.direction_frequencies);
  options.field.shading = human.shading;
  options.field.density_activation = activation_from(human.density);
  options.field.density_bias = 0;
  options.field.feature_hidden = config.features.hidden == "trained";
  options.box_margin = human.box_margin;
  options.distance_prior = human.distance_prior;
  const bool corrections = human.corrections == "learned" || (human.corrections == "auto" && !exact_poses);
  options.bone_corrections = corrections && human.bone_corrections;
  options.error_correction = corrections && human.error_correction;
  options.error_input = human.error_input == "observed" ? ErrorInput::observed : ErrorInput::canonical;
  options.error_layers = static_cast<int>(human.error_layers);
  options.error_width = static_cast<int>(human.error_width);
  return options;
}

StylizerOptions stylizer_options(const Config& config) {
  StylizerOptions options;
  options.cosine = config.style.attention == "cosine";
  options.feature_weight = config.style.feature_weight;
  options.luma_weight = options.cosine ? 0 : config.style.luma_weight;
  return options;
}

}  // namespace

CaptureModel::CaptureModel(Device& device, const Config& config, const Capture& capture) : device_(device) {
  const Initializer initializer(static_cast<std::uint64_t>(config.training.seed));
  const SceneSpace space = scene_space(capture, {.near = config.scene.near,
                                                 .far = config.scene.far,
                                                 .radius = config.scene.radius,
                                                 .shape = config.scene.shape,
                                                 .ground = config.scene.ground});
  const FieldOptions options = scene_field_options(config, space);
  const bool occupied = options.encoding == Encoding::occupied;
  scene_ = std::make_unique<SceneModel>(
      device, store_, initializer, options, space,
      static_cast<int>(space.shell ? config.scene.shell_samples : config.scene.samples),
      occupied ? occupied_points(space, capture.points) : std::vector<float>{},
      space.shell ? 0 : static_cast<int>(config.scene.coarse_samples));
  const int training_frames = static_cast<int>(capture.training_frames().size());
  // A turn and the scene's depth cannot be told apart while the depth is not there yet: where there is
  // parallax, exact cameras would be bent (docs/training.md).
  if (config.scene.cameras == "refined" || (config.scene.cameras == "auto" && space.shell))
    cameras_ = std::make_unique<CameraRefinement>(
        store_, training_frames, space.shell ? 0 : config.scene.camera_shift * space.radius.maxCoeff());
  if (config.scene.exposure_rate > 0)
    exposures_ = std::make_unique<ExposureCorrection>(store_, training_frames);
  if (capture.human)
    human_ = std::make_unique<HumanModel>(
        device, store_, initializer, human_options(config, capture.human->exact),
        shaped(capture.human->body, capture.human->poses.shape), training_frames);
  stylizer_ = std::make_unique<Stylizer>(store_, initializer, stylizer_options(config), group_style);
  content_norm_ = std::make_unique<RunningContentNorm>(store_);
  store_.allocate(device);
  load_stylizer(store_, *stylizer_, read_safetensors(shipped_stylizer("guided")));
}

Capture CaptureModel::corrected(const Capture& capture) const {
  const Capture seen = cameras_ ? cameras_->corrected(capture) : capture;
  return exposures_ ? exposures_->corrected(seen) : seen;
}

HumanModel::CodeRow novel_codes(const Config& config, const HumanModel& model) {
  return config.human.novel_codes == "mean" ? model.mean_codes() : model.mixed_codes({});
}

HumanRenderer::Options human_renderer_options(const Config& config, bool view_direction) {
  return {.step = config.human.render_step,
          .threshold = config.human.threshold,
          .view_direction = view_direction,
          .intervals = intervals_from(config.human.intervals)};
}

}  // namespace vivant
