#include "jobs/feature_views.hpp"

#include <algorithm>

#include "vivant/data/camera_path.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/model/composite_renderer.hpp"
#include "vivant/ops/concat.hpp"

namespace vivant {
namespace {

constexpr int scale = Stylizer::scale;
constexpr std::int64_t field_channels = Field::hidden_width + 1;
constexpr double orbit_angle = 25;  // degrees to each side of the middle frame's camera

struct View {
  int frame = -1;
  Camera camera;
  std::optional<PersonState> person;
};

/// Renders scene, and person if there is one, to one output.
class OutputRenderer {
 public:
  OutputRenderer(Device& device, const Config& config, const CaptureModel& model, bool known, Output output) {
    HumanRenderer::Options options = human_renderer_options(config, known);
    options.output = output;
    if (model.human())
      both_.emplace(device, model.scene(), *model.human(), options);
    else
      scene_.emplace(device, model.scene(), SceneRenderer::Options{.output = output});
  }
  cv::Mat render(const Camera& camera, const std::optional<PersonState>& person) {
    RenderedView rendered = both_ ? both_->render(camera, *person).picture : scene_->render(camera);
    const auto channels = static_cast<int>(rendered.pixels.size() / (rendered.width * rendered.height));
    return cv::Mat(rendered.height, rendered.width, CV_32FC(channels), rendered.pixels.data()).clone();
  }

 private:
  std::optional<SceneRenderer> scene_;
  std::optional<CompositeRenderer> both_;
};

std::vector<FeatureView> render_views(Device& device, const Config& config, const CaptureModel& model,
                                      const std::vector<View>& views, bool known, const std::string& name,
                                      Progress& progress) {
  OutputRenderer colours(device, config, model, known, Output::colour),
      hidden(device, config, model, known, Output::hidden);
  std::vector<FeatureView> result;
  progress.begin(name, 0, static_cast<std::int64_t>(views.size()));
  for (const View& view : views) {
    const Camera camera = feature_camera(view.camera);
    result.push_back({view.frame, padded_picture(colours.render(view.camera, view.person)),
                      hidden.render(camera, view.person), camera, view.person});
    progress.report({.step = static_cast<std::int64_t>(result.size())});
    if (interrupted()) {
      progress.end();
      throw Interrupted("stopped between two stages, all is saved; --resume goes on");
    }
  }
  progress.end();
  return result;
}

/// `count` of `all`, spread evenly.
std::vector<int> spread(const std::vector<int>& all, std::int64_t count) {
  const auto total = static_cast<std::int64_t>(all.size());
  count = std::min(count, total);
  std::vector<int> chosen;
  for (std::int64_t i = 0; i < count; ++i) chosen.push_back(all[i * total / count]);
  return chosen;
}

}  // namespace

cv::Mat padded_picture(const cv::Mat& rgb) {
  const auto more = [](int side) { return (scale - side % scale) % scale; };
  cv::Mat picture;
  rgb.convertTo(picture, CV_32F, rgb.depth() == CV_8U ? 1.0 / 255 : 1.0);
  picture = cv::min(cv::max(picture, 0.0), 1.0);
  cv::copyMakeBorder(picture, picture, 0, more(rgb.rows), 0, more(rgb.cols), cv::BORDER_REPLICATE);
  return picture;
}

std::vector<FeatureView> training_views(Device& device, const Config& config, const Capture& capture,
                                        const CaptureModel& model, std::int64_t limit, Progress& progress) {
  std::vector<View> views;
  for (const int frame : spread(capture.training_frames(), limit)) {
    views.push_back({frame, capture.frames[frame].camera, {}});
    if (model.human()) views.back().person = captured_state(*model.human(), capture, frame);
  }
  return render_views(device, config, model, views, true, "training views", progress);
}

std::vector<FeatureView> novel_views(Device& device, const Config& config, const Capture& capture,
                                     const CaptureModel& model, std::int64_t count, Progress& progress) {
  const std::vector<int> frames = capture.training_frames();
  const int middle = frames[frames.size() / 2];
  const std::int64_t orbits = model.human() ? (count + 1) / 2 : count;
  std::vector<View> views;
  for (const Camera& camera :
       orbit(capture.frames[middle].camera, focus_point(capture), up_direction(capture), -orbit_angle,
             orbit_angle, static_cast<int>(orbits)))
    views.push_back({-1, camera, {}});
  if (const HumanModel* human = model.human()) {
    const HumanModel::CodeRow codes = novel_codes(config, *human);
    const Motion& poses = capture.human->poses;
    const auto pose_of = [&](int frame) {
      return novel_state(poses, capture.frames[frame].body_frame, codes);
    };
    for (View& view : views) view.person = pose_of(middle);
    const std::vector<int> cameras = spread(frames, count - orbits);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      views.push_back({-1, capture.frames[cameras[i]].camera,
                       pose_of(cameras[(i + cameras.size() / 2) % cameras.size()])});
  }
  return render_views(device, config, model, views, false, "novel views", progress);
}

cv::Mat hidden_now(Device& device, const Config& config, const CaptureModel& model, const FeatureView& view) {
  return OutputRenderer(device, config, model, true, Output::hidden).render(view.camera, view.person);
}

Value rendered_features(Graph& graph, const CaptureModel& model, Value hidden) {
  const auto of = [&](const Field& field, std::int64_t first) {
    return field.feature(graph, slice(hidden, -1, first, Field::hidden_width),
                         slice(hidden, -1, first + Field::hidden_width, 1));
  };
  const Value scene = of(model.scene().field(), 0);
  return model.human() ? add(scene, of(model.human()->field(), field_channels)) : scene;
}

std::int64_t hidden_channels(const CaptureModel& model) { return (model.human() ? 2 : 1) * field_channels; }

}  // namespace vivant
