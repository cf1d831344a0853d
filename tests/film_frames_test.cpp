#include "vivant/jobs/film_frames.hpp"

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "tiny_run.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/jobs/picture_scores.hpp"
#include "vivant/jobs/temporal_mean.hpp"

using namespace vivant;

namespace {

/// A run of scene and person that can be stylised, with as little training as there can be.
struct TrainedRun {
  TemporaryFolder folder;
  Device device;
  Progress progress{ProgressMode::none, false};
  OpenRun run =
      open_run(device,
               make_tiny_run(device, folder.path(), true, 0,
                             {"scene.steps=20", "human.steps=20", "features.steps=2", "features.views=2"}),
               progress);
};

/// How far the pictures of two shots lie apart along the flow.
double change(FilmFrames& frames, int from, int to, const cv::Mat& first, const cv::Mat& second) {
  const SurfaceFlow flow(nullptr, 1);
  const cv::Mat forward = flow.flow(frames.surface(from), frames.surface(to)),
                visible = visible_pixels(forward, flow.flow(frames.surface(to), frames.surface(from)));
  REQUIRE(cv::countNonZero(visible) > visible.total() / 2);
  return rmse(first, warped(second, forward), visible);
}

}  // namespace

TEST_CASE("film frames: the mean over neighbouring shots, whichever are asked for first") {
  TrainedRun trained;
  Device& device = trained.device;
  const OpenRun& run = trained.run;
  const FilmOptions options{.views = "orbit", .orbit_angle = 3, .orbit_frames = 6, .size = std::pair(96, 72)};
  const Film film = plan_film(run, run, options);
  Look look = Look::whole({{asset_path("styles/cubist.jpg")}});
  look.brushwork = 0;  // the mean alone
  for (const std::string layers : {"both", "human"}) {
    CAPTURE(layers);
    FilmFrames frames(device, run, run, film, layers, {look});
    std::vector<std::vector<float>> in_order;
    in_order.reserve(film.shots.size());
    for (int shot = 0; shot < 6; ++shot) in_order.push_back(frames.stylised(shot, 0).rgb);

    // Backwards, and as a film of a single shot.
    CHECK(frames.stylised(1, 0).rgb == in_order[1]);
    FilmOptions single = options;
    single.frames = {4, 5};
    const Film one = plan_film(run, run, single);
    CHECK(one.shots.size() == 1);
    CHECK(FilmFrames(device, run, run, one, layers, {look}).stylised(0, 0).rgb == in_order[4]);

    // What each shot is without its neighbours.
    FilmRenderer renderer(device, run, run, film, layers, true);
    FilmStylizer stylizer(device, run, film, renderer, {look});
    std::vector<cv::Mat> alone, together;
    for (int shot : {2, 3}) {
      LayerFrame frame = renderer.render(film.shots[shot]);
      const std::vector<float> painted =
          stylizer.paint(frame, 0, frame.alpha.empty() ? Layer::scene : Layer::person);
      frame.rgb = painted;
      for (std::size_t i = 0; i < frame.alpha.size(); ++i)
        for (int c = 0; c < 3; ++c) frame.rgb[3 * i + c] *= frame.alpha[i];
      alone.push_back(to_picture(frame));
      frame.rgb = in_order[shot];
      together.push_back(to_picture(frame));
    }
    if (layers == "both")
      CHECK(change(frames, 2, 3, together[0], together[1]) < 0.9 * change(frames, 2, 3, alone[0], alone[1]));
    else
      CHECK(cv::norm(alone[0], together[0]) > 0);
    CHECK(cv::norm(to_picture(frames.painted_alone(2, 0)), alone[0], cv::NORM_INF) == 0);
    if (layers != "both") continue;
    // The mean of the same frames as pictures of another film: alike up to their 256 levels.
    std::vector<cv::Mat> pictures;
    pictures.reserve(film.shots.size());
    for (int shot = 0; shot < 6; ++shot) pictures.push_back(to_picture(frames.painted_alone(shot, 0)));
    const cv::Mat averaged = frames.averaged(2, pictures);
    CHECK(cv::norm(averaged, together[0], cv::NORM_L1) / static_cast<double>(averaged.total()) < 3);
    CHECK(cv::norm(averaged, together[0], cv::NORM_L1) < 0.2 * cv::norm(averaged, alone[0], cv::NORM_L1));
  }

  // A layer without a style, and a look of no strength, are as rendered.
  Look person_alone = look, none = look;
  person_alone.scene.clear();
  none.strength = 0;
  FilmFrames frames(device, run, run, film, "both", {person_alone, none});
  const LayerFrame layered = frames.stylised(2, 0), faint = frames.stylised(2, 1);
  const cv::Mat person = frames.surface(2).person;
  FilmRenderer renderer(device, run, run, film, "both", true);
  FilmStylizer stylizer(device, run, film, renderer, {person_alone, none});
  const LayerFrame frame = renderer.render(film.shots[2]);
  CHECK(faint.rgb == stylizer.paint(frame, 1, Layer::scene));
  int beside = 0;
  for (int i = 0; i < static_cast<int>(person.total()); ++i) {
    if (person.ptr<float>()[i] > 0) continue;
    ++beside;
    for (int c = 0; c < 3; ++c) CHECK(layered.rgb[3 * i + c] == frame.rgb[3 * i + c]);
  }
  CHECK(beside > 1000);
}

TEST_CASE("film frames: brushwork lies on what is painted, and nowhere else") {
  TrainedRun trained;
  Device& device = trained.device;
  const OpenRun& run = trained.run;
  const Film film =
      plan_film(run, run, {.views = "orbit", .orbit_angle = 3, .orbit_frames = 2, .size = std::pair(96, 72)});
  Look plain = Look::whole({{asset_path("styles/impasto.jpg")}}), brushed = plain, grey = plain,
       person = plain;
  plain.brushwork = 0;
  grey.keep_colour = true;
  person.scene.clear();
  Look grey_plain = grey, person_plain = person;
  grey_plain.brushwork = person_plain.brushwork = 0;
  FilmFrames frames(device, run, run, film, "both", {plain, brushed, grey_plain, grey, person_plain, person});
  const auto picture = [&](std::size_t look) {
    const LayerFrame frame = frames.stylised(1, look);
    return cv::Mat(frame.rgb, true).reshape(3, frame.height);
  };
  const cv::Mat strokes = picture(1) - picture(0);
  CHECK(cv::norm(strokes) / std::sqrt(static_cast<double>(3 * strokes.total())) > 0.005);
  CHECK(frames.painted_alone(1, 1).rgb != frames.painted_alone(1, 0).rgb);
  // Asked again, and by other frames: it does not gather.
  CHECK(frames.painted_alone(1, 1).rgb == frames.painted_alone(1, 1).rgb);
  CHECK(FilmFrames(device, run, run, film, "both", {brushed}).stylised(1, 0).rgb ==
        frames.stylised(1, 1).rgb);
  FilmFrames alone(device, run, run, film, "human", {plain, brushed});
  CHECK(alone.stylised(1, 0).rgb != alone.stylised(1, 1).rgb);

  // With the reconstruction's colours strokes are light and shade alone, but for colours that would leave [0,
  // 1].
  const cv::Mat light = picture(3) - picture(2);
  CHECK(cv::norm(light) > 0.1);
  const auto grey_share = [](const cv::Mat& added) {
    int grey_pixels = 0;
    for (int i = 0; i < static_cast<int>(added.total()); ++i) {
      const cv::Vec3f& stroke = added.ptr<cv::Vec3f>()[i];
      grey_pixels += std::abs(stroke[0] - stroke[1]) < 1e-5 && std::abs(stroke[0] - stroke[2]) < 1e-5;
    }
    return grey_pixels / static_cast<double>(added.total());
  };
  CHECK(grey_share(light) > 0.5);
  CHECK(grey_share(strokes) < 0.1);

  const cv::Mat share = frames.surface(1).person, layered = picture(5) - picture(4);
  int on_person = 0;
  for (int i = 0; i < static_cast<int>(share.total()); ++i) {
    const bool changed = cv::norm(layered.ptr<cv::Vec3f>()[i]) > 0;
    if (share.ptr<float>()[i] == 0) CHECK(!changed);
    on_person += changed;
  }
  CHECK(on_person > 20);
}
