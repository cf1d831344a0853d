#include "vivant/jobs/film_stylizer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "stylizer_fixture.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/model/style_score.hpp"

using namespace vivant;

namespace {

/// Colours and features of a picture, which stand for what fields render.
struct View {
  cv::Mat content;  // CV_32FC3
  std::vector<float> features;

  View(StylizerFixture& f, const std::string& picture, cv::Size size, double blur = 0) {
    cv::resize(read_image(asset_path("styles/" + picture)), content, size, 0, 0, cv::INTER_AREA);
    if (blur > 0) cv::GaussianBlur(content, content, {}, blur);
    content.convertTo(content, CV_32F, 1.0 / 255);
    features = f.features(content);
  }
  RenderedFrame frame() const { return {features, floats_of(content)}; }
};

cv::Mat eight_bit(const std::vector<float>& rgb, cv::Size size) {
  cv::Mat result;
  cv::Mat(size, CV_32FC3, const_cast<float*>(rgb.data())).convertTo(result, CV_8U, 255);
  return result;
}

}  // namespace

TEST_CASE(
    "film stylizer: features go no further than the painting asks for, nor than a distance that grows") {
  static_assert(film_feature_matches == std::array{1.0, 1.25, 1.5, 2.0});
  struct {
    std::vector<double> distances;  // of the matches, as far as they are asked for
    double chosen;
  } const cases[] = {
      {{5, 6}, 1},                 // further away at once
      {{5, 4.99, 4.98, 4.96}, 1},  // 1 % nearer is not worth it
      {{5, 4.9, 4.8, 4.7}, 2},
      {{5, 4.9, 4.8, 4.78}, 1.5},
      {{5, 4, 4.01}, 1.25},
      {{5, 5, 5, 3}, 2},  // a distance that stays is gone on from
  };
  for (const auto& one : cases) {
    CAPTURE(one.distances);
    std::vector<double> asked;
    CHECK(least_good_match([&](double match) {
            asked.push_back(match);
            return one.distances.at(asked.size() - 1);
          }) == one.chosen);
    CHECK(asked.size() == one.distances.size());
    CHECK(std::equal(asked.begin(), asked.end(), film_feature_matches.begin()));
  }
}

TEST_CASE("film stylizer: every second view is scored, and colours are matched in all") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const cv::Size size(96, 64);
  const cv::Mat painting = read_image(asset_path("styles/ink_wash.jpg"));
  const StylePicture style{painting};
  const View views[] = {
      {f, "cubist.jpg", size, 4}, {f, "woodblock.jpg", size}, {f, "pointillism.jpg", size, 2}};
  const std::vector<RenderedFrame> frames = {views[0].frame(), views[1].frame(), views[2].frame()};
  const std::vector<RenderedFrame> scored = {frames[0], frames[2]};

  FrameStylizer painter(f.device, f.stylizer, f.vgg, size.height, size.width, {.tokens = 256});
  StyleMeter meter(f.device, f.vgg, painting);
  painter.set_style({&style, 1}, painter.measure(frames));
  const auto sum_of = [&](const std::vector<RenderedFrame>& these) {
    return [&, these](double match) {
      double sum = 0;
      const std::vector<std::vector<float>> stylised = painter.set_feature_match(match, these);
      for (std::size_t i = 0; i < these.size(); ++i) {
        CHECK(stylised.at(i) == painter.stylise(these[i]));
        sum += meter.distance(eight_bit(stylised[i], size)).statistics;
      }
      return sum;
    };
  };
  const double expected = least_good_match(sum_of(scored));
  CHECK(expected != least_good_match(sum_of(frames)));  // the views in between would choose another one
  CHECK(choose_feature_match(f.device, f.vgg, painter, {&style, 1}, frames, size) == expected);

  const std::vector<float> chosen = painter.stylise(frames[1]);
  CHECK(chosen == painter.set_feature_match(expected, frames)[1]);
  painter.set_feature_match(expected, scored);
  CHECK(chosen != painter.stylise(frames[1]));
}

TEST_CASE("film stylizer: a mixture's match does not depend on its order, and small frames go the way once") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const StylePicture ink{read_image(asset_path("styles/ink_wash.jpg")), 0.9},
      wood{read_image(asset_path("styles/woodblock.jpg")), 0.1};
  for (const cv::Size size : {cv::Size(64, 64), cv::Size(24, 20)}) {
    const View view(f, "cubist.jpg", size);
    const RenderedFrame frame = view.frame();
    std::vector<double> chosen;
    for (const std::vector<StylePicture>& mixture :
         {std::vector{ink}, std::vector{ink, wood}, std::vector{wood, ink}}) {
      FrameStylizer painter(f.device, f.stylizer, f.vgg, size.height, size.width, {.tokens = 256});
      painter.set_style(mixture, painter.measure({&frame, 1}));
      chosen.push_back(choose_feature_match(f.device, f.vgg, painter, mixture, {&frame, 1}, size));
    }
    CHECK(chosen[1] == chosen[2]);
    if (size.height < 32)
      for (const double match : chosen) CHECK(match == 1);
  }
}
