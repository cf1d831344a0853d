#include "vivant/jobs/evaluate_motion.hpp"

#include "child_process.hpp"
#include "io_helpers.hpp"
#include "tiny_run.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

namespace {

/// A run whose person fills about their body, in a film of them dancing.
struct DancingRun {
  DancingRun() { set_density(3); }
  void set_density(float bias) { run.model->store().write("human.density.bias", std::vector<float>{bias}); }
  MotionEvaluation evaluated(const FilmOptions& options, const std::filesystem::path& output = {}) {
    return evaluate_motion(device, run, run, options, output, progress);
  }

  TemporaryFolder folder;
  Device device;
  Progress progress{ProgressMode::none, false};
  OpenRun run = open_run(device, make_tiny_run(device, folder.path(), true), progress);
  FilmOptions film{.views = "first",
                   .size = std::pair{96, 72},
                   .frames = std::pair{20, 23},
                   .motion = folder / "capture/dance.safetensors"};
};

}  // namespace

TEST_CASE("evaluate motion: a person who fills the body, and one who is not there") {
  DancingRun dancing;
  const MotionEvaluation solid = dancing.evaluated(dancing.film, dancing.folder / "report");
  REQUIRE(solid.frames.size() == 3);
  for (const MotionFrameScore& frame : solid.frames) {
    CHECK(frame.silhouette_iou.value() > 0.8);
    CHECK(frame.least_limb.value().share > 0.9);
    CHECK(frame.detached.value() < 0.01);
  }
  for (const char* file : {"rendered.mp4", "outlined.mp4", "report.json", "report.md", "index.html"})
    CHECK(std::filesystem::exists(dancing.folder / "report" / file));
  const nlohmann::ordered_json json = solid.json();
  CHECK(json.at("frames").at(1).at("silhouette_iou") == *solid.frames[1].silhouette_iou);
  CHECK(json.at("frames").at(2).at("limb") == solid.frames[2].least_limb->limb);
  CHECK(json.at("worst").at("silhouette_iou").at("value") <= json.at("silhouette_iou").get<double>());
  CHECK(solid.report().plots.at(1).curves.at(0).values.at(2) == solid.frames[2].least_limb->share);

  // Where a metre is half a unit, and the person looks half as tall.
  FilmOptions smaller = dancing.film;
  smaller.place = Place{{0, 0, 0}, 0, 0.5};
  smaller.size = std::pair{192, 144};
  smaller.frames = std::pair{20, 21};
  CHECK(dancing.evaluated(smaller).frames[0].silhouette_iou.value() > 0.8);

  dancing.set_density(-30);
  const MotionEvaluation absent = dancing.evaluated(dancing.film);
  for (const MotionFrameScore& frame : absent.frames) {
    CHECK(frame.silhouette_iou.value() == 0);
    CHECK(frame.least_limb.value().share == 0);
    CHECK(frame.detached.value() == 0);
  }
}

TEST_CASE("evaluate motion: the worst frame, and frames without a figure") {
  MotionEvaluation evaluation;
  evaluation.frames = {{0.9, LimbCover{"head", 0.8}, 0.0},
                       {},
                       {0.5, LimbCover{"left hand", 0.1}, 0.2},
                       {0.7, std::nullopt, 0.1}};
  const nlohmann::ordered_json json = evaluation.json();
  CHECK(json.at("silhouette_iou").get<double>() == doctest::Approx(0.7));
  CHECK(json.at("least_limb").get<double>() == doctest::Approx(0.45));
  CHECK(json.at("detached").get<double>() == doctest::Approx(0.1));
  CHECK(json.at("worst").at("silhouette_iou").at("frame") == 2);
  CHECK(json.at("worst").at("least_limb").at("limb") == "left hand");
  CHECK(json.at("worst").at("detached").at("value") == 0.2);
  CHECK(json.at("frames").at(1) == nlohmann::ordered_json{{"frame", 1}});
  CHECK(contains(evaluation.report().text(), "0.4500  0.1000      2  left hand"));
  CHECK(!contains(evaluation.report().html(), "nan"));
}

TEST_CASE("evaluate motion: a person who is not in the pictures, and a run without one") {
  DancingRun dancing;
  dancing.film.place = Place{{0, 0, 50}, 0};  // behind the camera
  CHECK(contains(error_of([&] { dancing.evaluated(dancing.film); }),
                 "no frame shows 300 pixels of the person"));

  const TemporaryFolder other;
  const OpenRun empty =
      open_run(dancing.device, make_tiny_run(dancing.device, other.path(), false), dancing.progress);
  CHECK(contains(
      error_of([&] { evaluate_motion(dancing.device, empty, empty, dancing.film, {}, dancing.progress); }),
      "has no person"));
}

TEST_CASE("evaluate motion: the command, and that a truth has poses of its own") {
  const Finished both = run_vivant("eval nowhere --motion dance.bvh --truth walk");
  CHECK(both.exit_code == 2);
  CHECK(both.err == "vivant: --truth has poses of its own: leave --motion out\n");
  for (const char* other : {"--truth walk", "--motion dance.bvh", "--style wave.jpg"}) {
    const Finished fitted = run_vivant(std::string("eval nowhere --fit-poses 10 ") + other);
    CAPTURE(other);
    CHECK(fitted.exit_code == 2);
    CHECK(contains(fitted.err, "leave --style, --motion and --truth out"));
  }
  const Finished no_film = run_vivant("eval nowhere --views test");
  CHECK(no_film.exit_code == 2);
  CHECK(no_film.err == "vivant: --views is of a film: give --motion or --style\n");

  DancingRun dancing;
  const Finished json = run_vivant("eval " + dancing.run.folder.path().string() + " --motion " +
                                   dancing.film.motion.string() + " --frames 0:2 --size 96x72 --json");
  REQUIRE_MESSAGE(json.exit_code == 0, json.err);
  CHECK(nlohmann::json::parse(json.out).at("frames").size() == 2);
}
