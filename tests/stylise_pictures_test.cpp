#include "vivant/jobs/stylise_pictures.hpp"

#include <opencv2/imgproc.hpp>

#include "graph_helpers.hpp"
#include "io_helpers.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/frames.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/model/stylizer.hpp"

using namespace vivant;

TEST_CASE("stylise: each picture by itself, in any size") {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "frames");
  cv::Mat picture;
  cv::resize(read_image(asset_path("styles/cubist.jpg")), picture, {46, 37}, 0, 0, cv::INTER_AREA);
  cv::Mat dark = picture / 2;
  write_image(folder / "frames/a.png", picture);
  write_image(folder / "frames/b.png", dark);
  write_image(folder / "frames/c.png", picture);
  Progress progress(ProgressMode::none, false);
  StylisePicturesOptions options{.input = folder / "frames",
                                 .style = asset_path("styles/ink_wash.jpg"),
                                 .stylizer = {},
                                 .tokens = 64,
                                 .output = folder / "out"};
  stylise_pictures(test_device(), options, progress);
  const std::vector<cv::Mat> painted = read_frames(folder / "out").pictures;
  REQUIRE(painted.size() == 3);
  REQUIRE(painted[0].size() == picture.size());
  CHECK(cv::norm(painted[0], painted[2], cv::NORM_INF) == 0);  // nothing is left of the frame between
  CHECK(cv::norm(painted[0], painted[1], cv::NORM_L1) > 0);
  CHECK(cv::norm(painted[0], picture, cv::NORM_L1) / static_cast<double>(3 * picture.total()) > 20);
  options.form = "cosine";
  options.output = folder / "AdaAttN";
  stylise_pictures(test_device(), options, progress);  // by the weights that come with the program
  const cv::Mat shipped = read_frames(options.output).pictures[0];
  CHECK(cv::norm(painted[0], shipped, cv::NORM_L1) > 0);
  CHECK(cv::norm(shipped, picture, cv::NORM_L1) / static_cast<double>(3 * picture.total()) > 20);
  options.form = "plain";
  CHECK(contains(error_of([&] { stylise_pictures(test_device(), options, progress); }),
                 "no weights of the form plain"));
  options.form = "cosine";
  options.output = folder / "cosine";
  ParameterStore store;
  const Initializer initializer(1);
  const Stylizer cosine(store, initializer, StylizerOptions::of_form("cosine"));
  store.allocate(test_device());
  options.stylizer = folder / "cosine.safetensors";
  write_safetensors(options.stylizer, save_stylizer(store, cosine));
  stylise_pictures(test_device(), options, progress);
  CHECK(cv::norm(shipped, read_frames(folder / "cosine").pictures[0], cv::NORM_L1) > 0);
  options.form = "sine";
  CHECK(contains(error_of([&] { stylise_pictures(test_device(), options, progress); }), "unknown form"));
  write_image(folder / "frames/d.png", cv::Mat(picture.colRange(0, 40)));
  CHECK(contains(error_of([&] { read_frames(folder / "frames"); }), "several sizes"));
}
