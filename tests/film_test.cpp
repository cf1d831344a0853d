#include "vivant/jobs/film.hpp"

#include <opencv2/imgcodecs.hpp>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "tiny_run.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/film_renderer.hpp"
#include "vivant/jobs/render.hpp"
#include "vivant/model/frame_stylizer.hpp"
#include "vivant/model/view_renderer.hpp"

using namespace vivant;
using Eigen::Vector3d;

namespace {

/// Two runs with a person and one without.
struct Runs {
  Runs() {
    Progress progress(ProgressMode::none, false);
    walk.emplace(open_run(device, make_tiny_run(device, folder / "walk", true), progress));
    other.emplace(open_run(device, make_tiny_run(device, folder / "other", true, 3), progress));
    empty.emplace(open_run(device, make_tiny_run(device, folder / "empty", false), progress));
  }
  TemporaryFolder folder;
  Device device;
  std::optional<OpenRun> walk, other, empty;
};

Vector3d root(const OpenRun& run, const Shot& shot) {
  return run.model->human()->body().body().joints[0] + shot.person->translation;
}

/// Where the person stands in a frame of the capture.
Placement start(const OpenRun& run, int frame = 0) {
  return standing_at(run.model->human()->body().body(), run.capture.human->poses,
                     run.capture.frames[frame].body_frame);
}

bool same_camera(const Camera& a, const Camera& b) { return a.world_to_camera == b.world_to_camera; }

/// In its own scene the person does what the views show.
void check_own_scene(const OpenRun& walk) {
  const Film film = plan_film(walk, walk, {.views = "train"});
  REQUIRE(film.shots.size() == walk.capture.training_frames().size());
  CHECK(film.known_poses);
  const int frame = walk.capture.training_frames()[1];
  CHECK(same_camera(film.shots[1].camera, walk.capture.frames[frame].camera));
  CHECK(film.shots[1].person->translation == walk.capture.human->poses.translation[frame]);
  CHECK(film.shots[1].capture_frame == frame);
  CHECK(plan_film(walk, walk, {.views = "orbit"}).shots[0].capture_frame == -1);
  const Film all = plan_film(walk, walk, {.views = "all"});
  REQUIRE(all.shots.size() == walk.capture.frames.size());
  CHECK(all.known_poses);
  CHECK(same_camera(all.shots[3].camera, walk.capture.frames[3].camera));
  CHECK(plan_film(walk, walk, {.views = "train", .frames = std::pair(2, 5)}).shots.size() == 3);
  CHECK(contains(error_of([&] { plan_film(walk, walk, {.views = "train", .frames = std::pair(2, 50)}); }),
                 "frames 2:50 are not among"));
  CHECK(contains(error_of([&] { plan_film(walk, walk, {.views = "trian"}); }), "unknown views 'trian'"));
}

/// A place moves the whole performance.
void check_place(const OpenRun& walk) {
  const Film own = plan_film(walk, walk, {.views = "train"});
  const Film moved =
      plan_film(walk, walk, {.views = "train", .place = Place{{1, 0.5, -1}, start(walk).yaw, 1}});
  CHECK_FALSE(moved.known_poses);
  const Vector3d shift = root(walk, moved.shots[0]) - root(walk, own.shots[0]);
  CHECK((root(walk, moved.shots[5]) - root(walk, own.shots[5]) - shift).norm() < 1e-9);
  CHECK(std::abs(shift.x() - (1 - start(walk).x)) < 1e-9);
  CHECK(std::abs(shift.y() - (0.5 - start(walk).y)) < 1e-9);
  CHECK(moved.shots[5].person->codes.error == own.shots[5].person->codes.error);
}

/// In another scene the performance is played before that scene's cameras, in its person's place.
void check_other_scene(const OpenRun& walk, const OpenRun& other, const std::filesystem::path& poses) {
  const Film film = plan_film(walk, other, {.views = "test"});
  REQUIRE(film.shots.size() == walk.capture.frames.size());
  const Camera& first = other.capture.frames[other.capture.held_out_frames()[0]].camera;
  CHECK(same_camera(film.shots[0].camera, first));
  const Placement there = start(other, other.capture.held_out_frames()[0]);
  CHECK(std::abs(root(walk, film.shots[0]).x() - there.x) < 1e-9);
  CHECK(std::abs(root(walk, film.shots[0]).z() - there.z) < 1e-9);
  CHECK_FALSE(film.known_poses);
  const Film animated = plan_film(walk, other, {.views = "first", .motion = poses});
  CHECK(same_camera(animated.shots.back().camera, other.capture.frames[0].camera));
  CHECK(std::abs(root(walk, animated.shots[0]).x() - start(other).x) < 1e-9);
  // An orbit goes around the middle frame's person, who is elsewhere than the first frame's.
  const int middle = static_cast<int>(other.capture.frames.size() / 2);
  const Film orbit = plan_film(walk, other, {.views = "orbit", .motion = poses});
  CHECK(std::abs(root(walk, orbit.shots[0]).x() - start(other, middle).x) < 1e-9);
  CHECK(std::abs(start(other, middle).x - start(other).x) > 0.01);
}

/// A scene without a person needs a place, and may have another unit.
void check_scene_without_person(const OpenRun& walk, const OpenRun& empty) {
  const std::string error = error_of([&] { plan_film(walk, empty, {.views = "first"}); });
  CHECK(contains(error, "give --place x,y,z,yaw,units (its cameras look at"));
  const Film film = plan_film(walk, empty, {.views = "first", .place = Place{{4, 0, 2}, 0, 2}});
  CHECK(film.units_per_metre == 2);
  CHECK(std::abs(root(walk, film.shots[0]).x() - 2) < 1e-9);
  CHECK(contains(error_of([&] { plan_film(empty, walk, {.views = "first"}); }), "has no person"));
  CHECK(contains(error_of([&] { plan_film(empty, empty, {.views = "first", .place = Place{}}); }),
                 "has no person"));
  CHECK_FALSE(plan_film(empty, empty, {.views = "first"}).shots[0].person);
}

}  // namespace

TEST_CASE("film: who stands where, seen from which cameras") {
  const Runs runs;
  check_own_scene(*runs.walk);
  check_place(*runs.walk);
  check_other_scene(*runs.walk, *runs.other,
                    runs.folder / "walk/capture/truth/novel_poses/poses.safetensors");
  check_scene_without_person(*runs.walk, *runs.empty);
}

TEST_CASE("film: pictures of the layers, and the person of one run in the scene of another") {
  Runs runs;
  Progress progress(ProgressMode::none, false);
  const auto picture = [&](const std::filesystem::path& scene, const std::string& layers) {
    RenderOptions options;
    options.run = runs.folder / "walk/run";
    options.scene = scene;
    options.film.views = "first";
    options.film.frames = {0, 1};
    options.layers = layers;
    options.output = runs.folder / "pictures";
    render(runs.device, options, progress);
    return cv::Mat(cv::imread((options.output / "0000.png").string(), cv::IMREAD_UNCHANGED));
  };
  const auto other = runs.folder / "other/run";
  const cv::Mat own = picture("", "both"), scene = picture("", "scene"), there = picture(other, "scene"),
                placed = picture(other, "both"), person = picture(other, "human");
  CHECK(own.size() == cv::Size(48, 36));
  CHECK(cv::norm(own, scene) > 0);
  CHECK(cv::norm(scene, there) > 0);
  CHECK(cv::norm(placed, there) > 0);
  REQUIRE(person.channels() == 4);
  // Where the person is transparent the other run's scene is seen as it is.
  cv::Mat alpha, difference;
  cv::extractChannel(person, alpha, 3);
  cv::absdiff(placed, there, difference);
  difference.setTo(0, alpha > 0);
  CHECK(cv::countNonZero(alpha > 0) > 5);
  CHECK(cv::norm(difference, cv::NORM_INF) <= tolerance(1, 3));
  CHECK(contains(error_of([&] {
                   RenderOptions options;
                   options.run = runs.folder / "empty/run";
                   options.layers = "human";
                   options.output = runs.folder / "pictures";
                   render(runs.device, options, progress);
                 }),
                 "has no person"));
}

TEST_CASE("film: a feature is the mean over its pixels, not what its middle shows") {
  const TemporaryFolder folder;
  Device device;
  Progress progress(ProgressMode::none, false);
  const OpenRun run = open_run(device, make_tiny_run(device, folder.path(), false), progress);
  const Film film = plan_film(run, run, {.views = "first"});
  const Shot& shot = film.shots[0];
  FilmRenderer renderer(device, run, run, film, "both", true);
  const std::vector<float> got = renderer.render(shot).features;

  const Camera small = feature_camera(shot.camera);
  constexpr int side = FilmRenderer::feature_rays;
  SceneRenderer fields(device, run.model->scene(), {.output = Output::feature});
  const auto rendered = [&](const Camera& camera) {
    std::vector<float> pixels = fields.render(camera).pixels;
    cv::Mat picture(camera.height, camera.width, CV_32FC(256), pixels.data());
    return picture.clone();
  };
  // Rays in threes a side are those of a picture of three times the size.
  const cv::Mat fine = rendered(small.resized(side * small.width, side * small.height));
  double largest = 0, from_middle = 0;
  const cv::Mat middle = rendered(small);
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      for (int c = 0; c < 256; ++c) {
        double sum = 0;
        for (int i = 0; i < side * side; ++i)
          sum += fine.ptr<float>(side * y + i / side, side * x + i % side)[c];
        const double mean = got[(static_cast<std::size_t>(y) * small.width + x) * 256 + c];
        largest = std::max(largest, std::abs(mean - sum / (side * side)));
        from_middle = std::max(from_middle, std::abs(mean - static_cast<double>(middle.ptr<float>(y, x)[c])));
      }
  CHECK(largest < tolerance(1e-4));
  CHECK(from_middle > 10 * largest);
}
