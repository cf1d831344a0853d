#include "vivant/jobs/capture_model.hpp"

namespace vivant {
namespace {

FieldOptions scene_field_options(const Config& config, const SceneSpace& space) {
  const auto& scene = config.scene;
  FieldOptions options;
  options.encoding = encoding_from(scene.planes);
  options.combine = combine_from(scene.combine);
  options.plane_size = scene.plane_size;
  options.channels = scene.plane_channels;
  options.unet_widths = scene.unet_widths;
  options.position_frequencies = static_cast<int>(scene.position_frequencies);
  options.direction_frequencies = static_cast<int>(scene.direction_frequencies);
  options.density_activation = activation_from(scene.density);
  if (space.shell) {
    // A thin shell is a panorama: planes optimised directly and no view dependence (experiments: 25.0 dB
    // against 22.6).
    options.encoding = Encoding::vanilla;
    options.plane_size = scene.shell_plane_size;
    options.direction_frequencies = 0;
  }
  return options;
}

}  // namespace

CaptureModel::CaptureModel(Device& device, const Config& config, const Capture& capture) : device_(device) {
  const Initializer initializer(static_cast<std::uint64_t>(config.training.seed));
  const SceneSpace space = scene_space(capture, {.near = config.scene.near,
                                                 .far = config.scene.far,
                                                 .radius = config.scene.radius,
                                                 .shape = config.scene.shape});
  const FieldOptions options = scene_field_options(config, space);
  const bool occupied = options.encoding == Encoding::occupied;
  scene_ = std::make_unique<SceneModel>(
      device, store_, initializer, options, space,
      static_cast<int>(space.shell ? config.scene.shell_samples : config.scene.samples),
      occupied ? occupied_points(space, capture.points) : std::vector<float>{});
  store_.allocate(device);
}

}  // namespace vivant
