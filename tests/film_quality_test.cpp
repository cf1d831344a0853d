#include "vivant/jobs/film_quality.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/jobs/evaluate_film.hpp"
#include "vivant/jobs/flow.hpp"

using namespace vivant;

namespace {

constexpr int width = 64, height = 48, count = 9, step = 2;

/// A painting that moves by `step` pixels a frame.
std::vector<cv::Mat> moving(const char* name) {
  cv::Mat painted;
  cv::resize(read_image(asset_path(std::string("styles/") + name)), painted, {width + step * count, height},
             0, 0, cv::INTER_AREA);
  std::vector<cv::Mat> frames;
  frames.reserve(count);
  for (int t = 0; t < count; ++t) frames.push_back(painted.colRange(step * t, step * t + width).clone());
  return frames;
}

cv::Mat known_flow(int from, int to) {
  return cv::Mat(height, width, CV_32FC2, cv::Scalar(step * (from - to), 0));
}

/// Every second frame brighter.
std::vector<cv::Mat> flickering(std::vector<cv::Mat> frames) {
  for (std::size_t t = 1; t < frames.size(); t += 2) {
    cv::Mat brighter = frames[t] + cv::Scalar(25, 25, 25);
    frames[t] = brighter;
  }
  return frames;
}

}  // namespace

TEST_CASE("film quality: a film that moves with the flow is consistent, a flickering one is not") {
  Progress progress(ProgressMode::none, false);
  const std::vector<cv::Mat> steady = moving("cubist.jpg");
  std::vector<cv::Mat> blurred = steady;
  for (cv::Mat& frame : blurred) {
    cv::Mat soft;
    cv::GaussianBlur(frame, soft, {}, 2);
    frame = soft;
  }
  FilmQuality quality = measure_films(
      test_device(), {{"unstylised", steady}, {"flicker", flickering(steady)}, {"blurred", blurred}},
      known_flow, read_image(asset_path("styles/cubist.jpg")), progress);
  quality.flow = "known";
  REQUIRE(quality.films.size() == 3);
  CHECK(quality.gaps == std::vector<int>{1, 7});
  CHECK(quality.visible[0] == doctest::Approx(1 - 2.0 / width));
  CHECK(quality.visible[1] == doctest::Approx(1 - 14.0 / width));
  const auto &still = quality.films[0].gaps, &flicker = quality.films[1].gaps;
  REQUIRE(still.size() == 2);
  CHECK(still[0].stlpips.size() == count - 1);
  CHECK(still[1].stlpips.size() == count - 7);
  for (const int gap : {0, 1}) {  // 1 and 7 are odd: both meet a brighter frame
    CHECK(still[gap].mean_rmse < 1e-3);
    CHECK(still[gap].mean_stlpips < 1e-3);
    CHECK(flicker[gap].mean_rmse > 0.05);
    CHECK(flicker[gap].mean_rmse < 0.1);
    CHECK(flicker[gap].mean_stlpips > 0.005);
  }
  // The blurred film is consistent too; that it is no painting any more is what the style says.
  CHECK(quality.films[2].gaps[0].mean_rmse < 0.01);
  CHECK(quality.films[2].mean_style.statistics > quality.films[0].mean_style.statistics);
  CHECK(quality.films[2].mean_style.content > 0.1);
  CHECK(quality.films[0].mean_style.content < 1e-5);

  // The wrong flow makes the steady film inconsistent.
  const FilmQuality wrong = measure_films(
      test_device(), {{"steady", steady}}, [](int from, int to) { return cv::Mat(-known_flow(from, to)); },
      {}, progress);
  CHECK(wrong.films[0].gaps[0].mean_rmse > 0.03);
  CHECK(wrong.style_frames.empty());

  const nlohmann::ordered_json json = quality.json();
  CHECK(json.at("films").at(1).at("consistency").at(0).at("rmse") == flicker[0].mean_rmse);
  CHECK(json.at("films").at(2).at("style").at("by_frame").size() == 8);
  std::vector<cv::Mat> shorter(steady.begin(), steady.end() - 1);
  CHECK(contains(error_of([&] {
                   measure_films(test_device(), {{"a", steady}, {"b", shorter}}, known_flow, {}, progress);
                 }),
                 "b has 8 frames, a has 9"));
}

TEST_CASE("film quality: DIS measures a film where it is clearly the better flow, not in a tie") {
  CHECK(better_flow(0.0175, 0.0174) == FlowKind::geometry);
  CHECK(better_flow(0.0175, 0.0175) == FlowKind::geometry);
  CHECK(better_flow(0.1, 0.0955) == FlowKind::geometry);
  CHECK(better_flow(0.1, 0.0945) == FlowKind::dis);
  CHECK(better_flow(0.1, 0.2) == FlowKind::geometry);
}

TEST_CASE("report: one page that holds all, and Markdown") {
  const TemporaryFolder folder;
  write_file(folder / "film.mp4", "no film");
  const Report report{"A & B",
                      {"One <note>."},
                      {{"Films", {"film", "RMSE"}, {{"first", cell(0.25, 3)}, {"second", cell(NAN, 3)}}}},
                      {{"Curve", "frame", "RMSE", {{"first", {0, 1, NAN, 2}}, {"second", {1, 1, 1}}}}},
                      {{"film", folder / "film.mp4"}}};
  write_report(folder / "report", report, {{"a", 1}});
  const std::string page = read_whole_file(folder / "report/index.html");
  CHECK(contains(page, "<h1>A &amp; B</h1>"));
  CHECK(contains(page, "One &lt;note&gt;."));
  CHECK(contains(page, "data:video/mp4;base64,bm8gZmlsbQ==\""));
  CHECK(contains(page, "<tr><td>second</td><td>-</td></tr>"));
  CHECK(contains(page, "<circle"));  // the last point of the first curve stands alone
  CHECK(!contains(page, "nan"));
  std::string numbers;  // at the axes
  for (std::size_t at = page.find("</text>"); at != std::string::npos; at = page.find("</text>", at + 1))
    numbers += page.substr(page.rfind('>', at) + 1, at - page.rfind('>', at) - 1) + " ";
  CHECK(numbers == "0 0.5 1 1.5 2 0 1 2 3 frame ");
  CHECK(contains(read_whole_file(folder / "report/report.md"),
                 "| film | RMSE |\n|---|---|\n| first | 0.250 |"));
  CHECK(contains(read_whole_file(folder / "report/report.json"), "\"a\": 1"));
  const Report flat{
      "Flat", {}, {}, {{"Curve", "frame", "RMSE", {{"first", {0.1, std::nextafter(0.1, 1.0)}}}}}, {}};
  write_report(folder / "flat", flat, {});
  CHECK(contains(read_whole_file(folder / "flat/index.html"), ">0.1</text>"));
  CHECK(report.text() == "film     RMSE\nfirst   0.250\nsecond      -\n");
}
