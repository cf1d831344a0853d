#include "vivant/jobs/evaluate.hpp"

#include <cmath>
#include <random>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "tiny_run.hpp"
#include "vivant/data/walk.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/picture_scores.hpp"
#include "vivant/jobs/pose_fit.hpp"
#include "vivant/model/composite_renderer.hpp"

using namespace vivant;

namespace {

/// dB: pictures that agree in every pixel, or in bf16, where tiles of another size round otherwise, in nearly
/// all.
double equal_from() { return tolerance(100, 60); }

struct TinyRun {
  TinyRun() {
    run.emplace(open_run(device, make_tiny_run(device, folder.path(), true), progress));
    // A solid person, and codes and view directions that are seen in the pictures.
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(-1, 1);
    ParameterStore& store = run->model->store();
    store.write("human.density.bias", std::vector<float>{8});
    for (const ParameterStore::Parameter& parameter : store.parameters()) {
      const bool seen = parameter.name.find("direction") != std::string::npos ||
                        parameter.name.starts_with("human.bone") || parameter.name.starts_with("human.error");
      if (!seen) continue;
      std::vector<float> values(parameter.shape.elements());
      for (float& value : values) value = 0.3f * uniform(random);
      store.write(parameter.name, values);
    }
  }
  const HumanModel& human() const { return *run->model->human(); }

  /// A capture of what the run itself shows of the person in these states, from its first camera.
  std::filesystem::path truth(const std::string& name, const Motion& poses,
                              const std::vector<PersonState>& states) {
    Capture capture;
    capture.source = folder / name / "transforms.json";
    capture.human = CaptureHuman{run->capture.human->body, poses};
    capture.scene_box = run->capture.scene_box;
    capture.scene_box_given = true;
    CompositeRenderer renderer(device, run->model->scene(), human(),
                               human_renderer_options(run->config, false));
    for (int i = 0; i < static_cast<int>(states.size()); ++i) {
      CaptureFrame frame;
      frame.camera = run->capture.frames[0].camera;
      frame.body_frame = i;
      frame.name = fmt::format("images/{}.png", i);
      frame.mask_name = fmt::format("masks/{}.png", i);
      const CompositeRenderer::View view = renderer.render(frame.camera, states[i]);
      for (const char* part : {"images", "masks"}) std::filesystem::create_directories(folder / name / part);
      write_image(folder / name / frame.name, view.picture.rgb8());
      write_image(folder / name / frame.mask_name, cv::Mat(view.person > 0.5));
      capture.frames.push_back(frame);
    }
    write_capture(capture, folder / name);
    return folder / name;
  }

  TemporaryFolder folder;
  Device device;
  Progress progress{ProgressMode::none, false};
  std::optional<OpenRun> run;
};

/// Colours that change smoothly over the person, who stands before a scene without fog. Directions, which
/// training leaves out at times, have no weight, nor has E, which with random weights moves points by metres.
void make_colourful(ParameterStore& store) {
  const Shape shape = store.find("human.planes").shape;
  std::vector<float> waves(shape.elements());
  for (std::int64_t i = 0; i < shape.elements(); ++i) {
    const std::int64_t channel = i % shape[3], column = i / shape[3] % shape[2],
                       row = i / shape[3] / shape[2] % shape[1];
    waves[i] = 1 + 0.8f * std::sin(static_cast<float>(channel + row + column));
  }
  store.write("human.planes", waves);
  std::vector<float> colour = store.read("human.colour.weight");
  for (float& weight : colour) weight *= 0.1f;  // within what pictures hold
  store.write("human.colour.weight", colour);
  store.write("scene.density.bias", std::vector<float>{-20});
  for (const ParameterStore::Parameter& parameter : store.parameters())
    if (parameter.name.find("direction") != std::string::npos || parameter.name.starts_with("human.error"))
      store.write(parameter.name, std::vector<float>(parameter.shape.elements()));
}

void check_equal(const Evaluation& evaluation, std::size_t frames) {
  REQUIRE(evaluation.frames.size() == frames);
  for (const FrameScore& score : evaluation.frames) {
    CAPTURE(score.frame);
    CHECK(score.full.psnr > equal_from());
    CHECK(score.person.value().psnr > equal_from());
    CHECK(score.silhouette_iou.value() == 1);
    CHECK(score.background.value().psnr > equal_from());
    CHECK(score.full.ssim == doctest::Approx(1));
    for (const RegionScore& region : {score.full, *score.person, *score.background})
      CHECK(region.stlpips.value() < 1e-6);
  }
}

}  // namespace

TEST_CASE("evaluate: held-out frames, and other captures of the same world") {
  TinyRun tiny;
  const Capture& capture = tiny.run->capture;
  const auto evaluated = [&](const std::filesystem::path& truth) {
    return evaluate(tiny.device, *tiny.run, {.truth = truth}, tiny.progress);
  };
  const Evaluation own = evaluated("");
  REQUIRE(own.frames.size() == capture.held_out_frames().size());
  CHECK(own.frames[1].frame == capture.frames[capture.held_out_frames()[1]].name);
  CHECK(own.mean.full.psnr == doctest::Approx((own.frames[0].full.psnr + own.frames[1].full.psnr) / 2));
  CHECK(own.json().at("silhouette_iou") == own.mean.silhouette_iou.value());
  CHECK(own.json().at("frames").at(1).at("background_stlpips") == own.frames[1].background->stlpips.value());
  CHECK(own.frames[0].full.stlpips.value() > 0.01);
  // The mask of synth is the posed body itself; what is rendered is all that is near it.
  for (const FrameScore& score : own.frames) {
    CHECK(score.body_iou.value() > 0.9);
    CHECK(score.body_iou.value() > score.silhouette_iou.value());
  }
  CHECK(own.json().at("body_iou") == own.mean.body_iou.value());
  CHECK(contains(own.report().markdown(), "| mean | "));
  CHECK(own.report().plots.at(0).curves.at(1).values.at(1) == own.frames[1].person->psnr);
  CHECK(evaluated(tiny.folder / "capture").frames.size() == capture.frames.size());

  // Instants of the capture keep their codes.
  std::vector<PersonState> states;
  states.reserve(3);
  for (int i = 0; i < 3; ++i) states.push_back(captured_state(tiny.human(), capture, i));
  check_equal(evaluated(tiny.truth("instants", tiny.run->given.human->poses, states)), 3);

  // Other poses have the novel codes.
  const Motion postures = posture_collection(capture.human->body);
  states.clear();
  for (int i = 0; i < 2; ++i)
    states.push_back(novel_state(postures, i, novel_codes(tiny.run->config, tiny.human())));
  check_equal(evaluated(tiny.truth("postures", postures, states)), 2);
}

TEST_CASE("evaluate: a truth without the person is refused") {
  TinyRun tiny;
  const TemporaryFolder other;
  make_tiny_run(tiny.device, other.path(), false);
  CHECK(contains(
      error_of([&] { evaluate(tiny.device, *tiny.run, {.truth = other / "capture"}, tiny.progress); }),
      "the frame images/0001.png shows no person"));
}

TEST_CASE("pose fit: each held-out frame takes the pose that its picture shows; the run stays as it is") {
  TinyRun tiny;
  OpenRun& run = *tiny.run;
  ParameterStore& store = run.model->store();
  make_colourful(store);
  const std::vector<int> held_out = run.capture.held_out_frames();
  CompositeRenderer renderer(tiny.device, run.model->scene(), tiny.human(),
                             human_renderer_options(run.config, true));
  // What the pictures show: the whole person 3 cm aside, each to another side.
  const std::int64_t joints = tiny.human().body().body().joint_count();
  std::vector<std::vector<float>> starts, shown;
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    CaptureFrame& frame = run.capture.frames[held_out[i]];
    PersonState state = captured_state(tiny.human(), run.capture, held_out[i]);
    starts.push_back(state.codes.bones);
    for (std::int64_t joint = 0; joint < joints; ++joint)
      state.codes.bones[6 * joint + 3] += i == 0 ? 0.3f : -0.3f;
    shown.push_back(state.codes.bones);
    CompositeRenderer::View view = renderer.render(frame.camera, state);
    frame.exposure = {.gain = Eigen::Array3d(0.8, 0.9, 1), .offset = Eigen::Array3d::Constant(0.02)};
    frame.exposure.apply(view.picture.pixels);
    frame.image_path = tiny.folder / fmt::format("shown{}.png", i);
    frame.mask_path = tiny.folder / fmt::format("mask{}.png", i);
    write_image(frame.image_path, view.picture.rgb8());
    write_image(frame.mask_path, cv::Mat(view.person > 0.5));
  }
  const std::vector<float> codes = store.read("human.bone_codes");
  constexpr std::int64_t steps = 150;
  const auto evaluated = [&](std::int64_t fit_steps) {
    return evaluate(tiny.device, run, {.fit_pose_steps = fit_steps}, tiny.progress);
  };
  const Evaluation before = evaluated(0), after = evaluated(steps);
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    CAPTURE(i);
    CHECK(before.frames[i].person->psnr < 32);
    CHECK(after.frames[i].person->psnr > before.frames[i].person->psnr + 4);
    CHECK(after.frames[i].full.psnr > before.frames[i].full.psnr + 4);
    CHECK(after.frames[i].silhouette_iou.value() > 0.95);
    CHECK(after.frames[i].body_iou.value() == before.frames[i].body_iou.value());  // of the given pose
  }
  const std::string note = "fitted to these very pictures and masks in 150 steps",
                    row = "poses fitted to these";
  CHECK(contains(after.report().markdown(), note));
  CHECK(contains(after.report().text(), row));
  CHECK(!contains(before.report().markdown(), note));
  CHECK(!contains(before.report().text(), row));
  CHECK(after.json().at("fitted_steps") == steps);
  CHECK(evaluated(steps).json() == after.json());
  CHECK(store.read("human.bone_codes") == codes);

  const auto fitted = fit_held_out_codes(tiny.device, run, steps, tiny.progress);
  const auto bones_with = [&](int unseen_views) {
    run.config.human.unseen_views = unseen_views;
    return fit_held_out_codes(tiny.device, run, 3, tiny.progress).front().bones;
  };
  CHECK(bones_with(12) == bones_with(0));
  const auto shift = [&](const std::vector<float>& bones) {  // the mean over joints, sideways
    double sum = 0;
    for (std::int64_t joint = 0; joint < joints; ++joint) sum += bones[6 * joint + 3];
    return sum / static_cast<double>(joints);
  };
  for (std::size_t i = 0; i < held_out.size(); ++i) {
    const double moved = shift(fitted[i].bones) - shift(starts[i]), all = shift(shown[i]) - shift(starts[i]);
    CAPTURE(i);
    CHECK(moved / all > 0.15);  // joints that are hidden or without texture stay
  }
  CHECK(contains(error_of([&] {
                   evaluate(tiny.device, run, {.truth = tiny.folder / "capture", .fit_pose_steps = 1},
                            tiny.progress);
                 }),
                 "not to another truth"));
}

TEST_CASE("pose fit: runs without a person or corrections give one clear line") {
  Device device;
  Progress progress(ProgressMode::none, false);
  const TemporaryFolder empty, exact;
  const OpenRun scene = open_run(device, make_tiny_run(device, empty.path(), false), progress),
                given =
                    open_run(device, make_tiny_run(device, exact.path(), true, 0, {"human.corrections=none"}),
                             progress);
  CHECK(contains(error_of([&] { fit_held_out_codes(device, scene, 1, progress); }), "has no person"));
  CHECK(contains(error_of([&] { fit_held_out_codes(device, given, 1, progress); }), "learns no corrections"));
}

TEST_CASE("picture scores: known differences, and masks") {
  cv::Mat a(48, 64, CV_8UC3, cv::Scalar(100, 100, 100)), b = a.clone();
  const cv::Rect left(0, 0, 32, 48);
  b(left).setTo(cv::Scalar(151, 151, 151));
  cv::Mat mask(a.size(), CV_8UC1, cv::Scalar(0));
  mask(left) = 255;
  CHECK(rmse(a, b, mask) == doctest::Approx(0.2));
  CHECK(rmse(a, b) == doctest::Approx(0.2 / std::sqrt(2)));
  CHECK(psnr(a, b, mask) == doctest::Approx(20 * std::log10(5)));
  CHECK(psnr(a, b, 255 - mask) == 120);
  CHECK(ssim(a, b, mask) < 0.95);
  CHECK(ssim(a, b, 255 - mask) > ssim(a, b));
  CHECK_THROWS_AS(rmse(a, b, cv::Mat(a.size(), CV_8UC1, cv::Scalar(0))), Error);
}
