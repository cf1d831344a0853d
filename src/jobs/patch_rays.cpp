#include "jobs/patch_rays.hpp"

#include <numeric>

#include "vivant/data/camera_table.hpp"
#include "vivant/model/composite.hpp"

namespace vivant {
namespace {

/// The camera of a part of the picture.
Camera cropped(Camera camera, const cv::Rect& part) {
  camera.width = part.width;
  camera.height = part.height;
  camera.cx -= part.x;
  camera.cy -= part.y;
  return camera;
}

}  // namespace

PatchRays::PatchRays(Device& device, Graph& graph, const Config& config, const CaptureModel& model, int side)
    : scene_planes_(device, model.scene().field()),
      camera_(graph.input("camera", {1, camera_table_columns})) {
  const HumanRenderer::Options options = human_renderer_options(config, true);
  std::vector<std::int32_t> pixels(static_cast<std::size_t>(side) * side);
  std::iota(pixels.begin(), pixels.end(), 0);
  const std::int64_t count = std::ssize(pixels);
  const Rays rays =
      ray_generation(camera_, graph.constant({count}, std::span<const std::int32_t>(pixels)), side, side);
  const SceneModel& scene = model.scene();
  const FieldSamples behind = scene.sample(graph, scene_planes_.value(graph), rays, nullptr, Output::hidden);
  if (const HumanModel* human = model.human()) {
    human_planes_.emplace(device, human->field());
    person_.emplace(graph, *human);
    const TraceOptions trace{.step = options.step,
                             .threshold = options.threshold,
                             .samples_per_ray = HumanRenderer::samples_per_ray};
    const HumanFieldSamples samples = person_->sample(graph, human_planes_->value(graph), rays, trace, 0,
                                                      options.view_direction, Output::hidden);
    hidden_ = composite_output(graph, scene, *human,
                               composite(graph, behind, samples, options.intervals, options.weight_threshold),
                               Output::hidden);
  } else {
    const RenderedRays seen = scene.render(graph, behind, options.weight_threshold);
    hidden_ = scene.field().output(graph, Output::hidden, seen.hidden, seen.alpha);
  }
  hidden_ = graph.reshape(hidden_, {side, side, hidden_channels(model)});
}

void PatchRays::write(Executor& executor, const FeatureView& view, const cv::Rect& patch) const {
  const Camera camera = cropped(view.camera, patch);
  executor.write(camera_, std::span<const float>(camera_table(std::span(&camera, 1))));
  if (person_) person_->write(executor, *view.person);
}

}  // namespace vivant
