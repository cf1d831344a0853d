// The program from a capture and paintings to stylised pictures, with as little training as there can be.
#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "io_helpers.hpp"
#include "tiny_training.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/json.hpp"

using namespace vivant;
namespace fs = std::filesystem;

namespace {

/// Stripes of two colours over noise.
void paint(const fs::path& file, const cv::Scalar& a, const cv::Scalar& b) {
  cv::Mat picture(96, 96, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y) picture.row(y).setTo(y / 8 % 2 == 0 ? a : b);
  cv::Mat noise(picture.size(), CV_8UC3);
  cv::theRNG().state = 1;
  cv::randu(noise, 0, 60);
  fs::create_directories(file.parent_path());
  REQUIRE(cv::imwrite(file, picture + noise));
}

std::vector<cv::Mat> pictures_in(const fs::path& folder) {
  std::vector<cv::String> names;
  cv::glob((folder / "*.png").string(), names);
  std::vector<cv::Mat> pictures;
  pictures.reserve(names.size());
  for (const cv::String& name : names) pictures.push_back(cv::imread(name));
  return pictures;
}

/// The mean difference of two pictures, of 255.
double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * 3);
}

/// Of the pixels: how far their channels lie apart, and how they vary over the picture.
void check_lively(const cv::Mat& picture) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(picture, mean, deviation);
  for (int c = 0; c < 3; ++c) CHECK(deviation[c] > 5);
  std::vector<cv::Mat> channels;
  cv::split(picture, channels);
  CHECK(cv::norm(channels[0], channels[2], cv::NORM_L1) / static_cast<double>(picture.total()) > 5);
}

/// `both` must be the scene's style where the person is not and lean to the person's where the person is, and
/// `unpainted` the same with the reconstruction in place of the person's style.
void check_layers(const cv::Mat& both, const cv::Mat& scene_style, const cv::Mat& person_style,
                  const cv::Mat& unpainted, const cv::Mat& plain) {
  double most = 0;
  int outside = 0;
  for (int y = 0; y < both.rows; ++y)
    for (int x = 0; x < both.cols; ++x) {
      const cv::Point at(x, y);
      const cv::Vec3d from = scene_style.at<cv::Vec3b>(at),
                      way = cv::Vec3d(person_style.at<cv::Vec3b>(at)) - from;
      if (cv::norm(way) < 60) continue;
      const cv::Vec3d here = cv::Vec3d(both.at<cv::Vec3b>(at)) - from;
      const double alpha = here.dot(way) / way.dot(way);
      most = std::max(most, alpha);
      outside += alpha < 0.02;
      CHECK(cv::norm(here - alpha * way) < 3);
      const cv::Vec3d other = cv::Vec3d(plain.at<cv::Vec3b>(at)) - from;
      for (int c = 0; c < 3; ++c) {
        const double as_is = from[c] + other[c];
        if (as_is == 0 || as_is == 255) continue;  // it may lie beyond
        CHECK(std::abs(from[c] + alpha * other[c] - unpainted.at<cv::Vec3b>(at)[c]) < 4);
      }
    }
  CHECK(most > 0.1);
  CHECK(outside > both.size().area() / 2);
}

/// `vivant eval --style` measures what `vivant render --style` has rendered, and writes its report.
void check_evaluation(const std::string& run, const fs::path& folder, const std::string& style) {
  const std::string report = folder / "report";
  std::map<std::string, nlohmann::json> unstylised;
  std::string chosen;
  for (const std::string flow : {"geometry", "auto", "dis"}) {
    const Finished evaluated = run_vivant(
        fmt::format("eval {} --views test --flow {} --style {} --film again={} --average-films --json -o {}",
                    run, flow, style, (folder / "in_red").string(), report));
    REQUIRE_MESSAGE(evaluated.exit_code == 0, evaluated.err);
    const nlohmann::json films = nlohmann::json::parse(evaluated.out).at("films");
    REQUIRE(films.size() == 6);
    unstylised[flow] = films[0].at("consistency");
    if (flow == "auto") chosen = nlohmann::json::parse(evaluated.out).at("flow");
    const std::vector<std::string> names = {"unstylised",        "capture", "vivant",
                                            "vivant-unaveraged", "again",   "again-averaged"};
    for (std::size_t i = 0; i < names.size(); ++i) CHECK(films[i].at("film") == names[i]);
    CHECK(films[2].at("consistency") == films[4].at("consistency"));
    CHECK(films[2].at("style") == films[4].at("style"));
    for (const int other : {3, 5}) CHECK(films[2].at("consistency") != films[other].at("consistency"));
    CHECK(films[0].at("style").at("content") == 0);
    CHECK(films[2].at("style").at("content") > 0.1);
    CHECK(films[2].at("consistency").at(0).at("rmse") != films[0].at("consistency").at(0).at("rmse"));
  }
  CHECK(unstylised["geometry"] != unstylised["dis"]);
  CHECK(unstylised["auto"] == unstylised[contains(chosen, "DIS on") ? "dis" : "geometry"]);
  CHECK(contains(chosen, "(chosen: "));
  const std::string page = read_whole_file(report + "/index.html");
  for (const char* part : {"<svg", "<video", "again", "ST-LPIPS", "DIS on the capture"})
    CHECK(contains(page, part));
  CHECK(fs::exists(report + "/vivant.mp4"));
  CHECK(pictures_in(report + "/unstylised").size() == 2);
  CHECK(contains(run_vivant("eval " + run + " --film a=b").err, "give --style"));
  CHECK(contains(run_vivant(fmt::format("eval {} --views first --style {} --film short={}", run, style,
                                        (folder / "in_red").string()))
                     .err,
                 "short has 2 frames, the run's film has 1"));
  CHECK(
      contains(run_vivant(fmt::format("eval {} --average-films --style {} --film a-averaged={} --film a={}",
                                      run, style, (folder / "in_red").string(), (folder / "in_red").string()))
                   .err,
               "two films are called 'a-averaged'"));
  CHECK(contains(run_vivant("eval " + run + " --average-films --style " + style).err, "give --film"));
  CHECK(
      contains(run_vivant("eval " + run + " --film vivant=b --style " + style).err, "two films are called"));
}

}  // namespace

TEST_CASE("styled render: pictures in the colours of each style, unlike the reconstruction") {
  const TemporaryFolder folder;
  const std::string run = folder / "run", red = folder / "styles/red.png", blue = folder / "blue.png";
  paint(red, {20, 20, 190}, {20, 110, 190});
  paint(blue, {190, 20, 20}, {110, 110, 20});
  std::string train =
      "train " + tiny_capture().string() + " --run " + run + " --styles " + (folder / "styles").string();
  for (const std::string& argument : tiny_settings(20, 20)) train += " " + argument;
  for (const std::string setting :
       {"features.steps=2", "features.views=2", "style.steps=1", "style.crop=64", "style.novel_views=0"})
    train += " --set " + setting;
  const Finished trained = run_vivant(train);
  REQUIRE_MESSAGE(trained.exit_code == 0, trained.err);

  const auto render = [&](const std::string& name, const std::string& options) {
    const Finished rendered =
        run_vivant("render " + run + " --views test -o " + (folder / name).string() + options);
    REQUIRE_MESSAGE(rendered.exit_code == 0, rendered.err);
    return pictures_in(folder / name);
  };
  const std::vector<cv::Mat> plain = render("plain", ""), in_red = render("in_red", " --style " + red),
                             in_blue = render("in_blue", " --style " + blue),
                             large = render("large", " --size 64x48 --style " + red);
  for (const std::vector<cv::Mat>* pictures : {&plain, &in_red, &in_blue, &large})
    REQUIRE(pictures->size() == 2);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    CHECK(plain[i].size() == cv::Size(48, 32));
    CHECK(large[i].size() == cv::Size(64, 48));
    REQUIRE(in_red[i].size() == plain[i].size());
    REQUIRE(in_blue[i].size() == plain[i].size());
    for (const cv::Mat& picture : {in_red[i], in_blue[i], large[i]}) check_lively(picture);
    CHECK(difference(in_red[i], plain[i]) > 10);
    CHECK(difference(in_blue[i], plain[i]) > 10);
    CHECK(difference(in_red[i], in_blue[i]) > 10);
    const cv::Scalar red_mean = cv::mean(in_red[i]), blue_mean = cv::mean(in_blue[i]);
    CHECK(red_mean[2] - red_mean[0] > blue_mean[2] - blue_mean[0] + 20);
  }
  CHECK(difference(in_red[0], in_red[1]) > 1);

  // Each layer in its own style, and one of them as it is: what changes is where the person is.
  const std::vector<cv::Mat> layers = render("layers", " --person-style " + red + " --scene-style " + blue),
                             scene = render("scene", " --style " + blue + " --person-style none"),
                             mixed = render("mixed", " --style " + red + ":0.5 --style " + blue + ":0.5"),
                             grey = render("grey", " --keep-colour --style " + red);
  check_layers(layers[0], in_blue[0], in_red[0], scene[0], plain[0]);
  CHECK(difference(mixed[0], in_red[0]) < difference(in_blue[0], in_red[0]));
  CHECK(difference(mixed[0], in_blue[0]) < difference(in_blue[0], in_red[0]));
  cv::Mat light, kept;
  cv::cvtColor(plain[0], light, cv::COLOR_BGR2YCrCb);
  cv::cvtColor(grey[0], kept, cv::COLOR_BGR2YCrCb);
  std::vector<cv::Mat> before, after;
  cv::split(light, before);
  cv::split(kept, after);
  CHECK(cv::norm(before[0], after[0], cv::NORM_L1) / static_cast<double>(before[0].total()) > 5);
  for (const int chroma : {1, 2})
    CHECK(cv::norm(before[chroma], after[chroma], cv::NORM_L1) / static_cast<double>(before[0].total()) < 4);
  check_evaluation(run, folder.path(), red);
  const Finished mistaken = run_vivant("render " + run + " --layers scene --person-style " + red + " -o " +
                                       (folder / "mistaken").string());
  CHECK(mistaken.exit_code == 2);
  CHECK(contains(mistaken.err, "the film shows no person"));
}
