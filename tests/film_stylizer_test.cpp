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

TEST_CASE("film stylizer: features go no further than the painting asks for") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const cv::Size size(96, 64);
  const cv::Mat painting = read_image(asset_path("styles/ink_wash.jpg"));

  const StylePicture style{painting};
  std::vector<double> chosen;
  for (const double blur : {0.0, 4.0}) {
    cv::Mat shown, content;
    cv::resize(read_image(asset_path("styles/cubist.jpg")), shown, size, 0, 0, cv::INTER_AREA);
    if (blur > 0) cv::GaussianBlur(shown, shown, {}, blur);
    shown.convertTo(content, CV_32F, 1.0 / 255);
    const std::vector<float> features = f.features(content);
    const RenderedFrame frame{features, values_of(content)};

    FrameStylizer painter(f.device, f.stylizer, f.vgg, size.height, size.width, {.tokens = 256});
    StyleMeter meter(f.device, f.vgg, painting);
    painter.set_style(painting, painter.measure({&frame, 1}), {&frame, 1});
    std::vector<double> distances;
    for (const double match : film_feature_matches) {
      const std::vector<float> rgb = painter.set_feature_match(match, {&frame, 1})[0];
      CHECK(rgb == painter.stylise(frame));
      cv::Mat result;
      cv::Mat(size, CV_32FC3, const_cast<float*>(rgb.data())).convertTo(result, CV_8U, 255);
      distances.push_back(meter.score(result, shown).statistics);
    }
    chosen.push_back(choose_feature_match(f.device, f.vgg, painter, {&style, 1}, {&frame, 1}, size));
    const std::size_t index =
        std::find(film_feature_matches.begin(), film_feature_matches.end(), chosen.back()) -
        film_feature_matches.begin();
    const double least = *std::min_element(distances.begin(), distances.end());
    CHECK(distances.at(index) <= 1.01 * least);
    for (std::size_t i = 0; i < index; ++i) CHECK(distances[i] > 1.01 * least);
    const std::vector<float> kept = painter.stylise(frame);
    CHECK(kept == painter.set_feature_match(chosen.back(), {&frame, 1})[0]);
  }
  CHECK(chosen[0] != chosen[1]);  // it is a choice
}

TEST_CASE("film stylizer: a mixture's match does not depend on its order, and small frames go the way once") {
  StylizerFixture f;
  load_stylizer(f.store, f.stylizer, read_safetensors(asset_path("stylizer.safetensors")));
  const StylePicture ink{read_image(asset_path("styles/ink_wash.jpg")), 0.9},
      wood{read_image(asset_path("styles/woodblock.jpg")), 0.1};
  for (const cv::Size size : {cv::Size(64, 64), cv::Size(24, 20)}) {
    cv::Mat content;
    cv::resize(read_image(asset_path("styles/cubist.jpg")), content, size, 0, 0, cv::INTER_AREA);
    content.convertTo(content, CV_32F, 1.0 / 255);
    const std::vector<float> features = f.features(content);
    const RenderedFrame frame{features, values_of(content)};
    std::vector<double> chosen;
    for (const std::vector<StylePicture>& mixture :
         {std::vector{ink}, std::vector{ink, wood}, std::vector{wood, ink}}) {
      FrameStylizer painter(f.device, f.stylizer, f.vgg, size.height, size.width, {.tokens = 256});
      painter.set_style(mixture, painter.measure({&frame, 1}), {&frame, 1});
      chosen.push_back(choose_feature_match(f.device, f.vgg, painter, mixture, {&frame, 1}, size));
    }
    CHECK(chosen[1] == chosen[2]);
    if (size.height < 32)
      for (const double match : chosen) CHECK(match == 1);
  }
}
