#include "vivant/jobs/stylise_pictures.hpp"

#include <opencv2/imgproc.hpp>

#include "vivant/graph/executor.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/frames.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/safetensors.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/model/frame_stylizer.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;

/// VGG features of pictures of one size, whose sides are extended to multiples of four.
class Encoder {
 public:
  Encoder(Device& device, const Vgg19& vgg, cv::Size size)
      : right_((4 - size.width % 4) % 4), below_((4 - size.height % 4) % 4) {
    picture_ = graph_.input("picture", {size.height + below_, size.width + right_, 3});
    features_ = vgg.features(picture_, {"relu3_1"}).at("relu3_1");
    executor_ = std::make_unique<Executor>(device, graph_, Values{features_});
  }
  /// `rgb`: CV_32FC3.
  std::vector<float> features(const cv::Mat& rgb) {
    cv::Mat extended;
    cv::copyMakeBorder(rgb, extended, 0, below_, 0, right_, cv::BORDER_REPLICATE);
    executor_->write(picture_, floats_of(extended));
    executor_->run();
    return executor_->read(features_);
  }

 private:
  int right_, below_;
  Graph graph_;
  Value picture_, features_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace

fs::path shipped_stylizer(const std::string& form) {
  return asset_path(form == "cosine" ? "adaattn.safetensors" : "stylizer.safetensors");
}

void stylise_pictures(Device& device, const StylisePicturesOptions& options, Progress& progress) {
  const Frames frames = read_frames(options.input);
  const cv::Mat painting = read_image(options.style);
  const cv::Size size = frames.pictures[0].size();
  const Vgg19 vgg(device);
  const Initializer initializer(0);
  ParameterStore store;
  const Stylizer stylizer(store, initializer, StylizerOptions::of_form(options.form));
  store.allocate(device);
  load_stylizer(
      store, stylizer,
      read_safetensors(options.stylizer.empty() ? shipped_stylizer(options.form) : options.stylizer));
  FrameStylizer::Options how = FrameStylizer::Options::of(stylizer);
  how.tokens = options.tokens;
  FrameStylizer painter(device, stylizer, vgg, size.height, size.width, how);
  Encoder encoder(device, vgg, size);
  make_folder(options.output);
  const InterruptGuard guard;
  const auto count = static_cast<std::int64_t>(frames.pictures.size());
  progress.begin("stylise", 0, count);
  for (std::int64_t i = 0; i < count; ++i) {
    cv::Mat rgb;
    frames.pictures[i].convertTo(rgb, CV_32F, 1.0 / 255);
    const std::vector<float> features = encoder.features(rgb);
    const RenderedFrame frame{features, floats_of(rgb)};
    const ContentNorm norm = painter.measure({&frame, 1});
    if (i == 0)
      painter.set_style(painting, norm, {&frame, 1});
    else
      painter.set_norm(norm);
    std::vector<float> colours = painter.stylise(frame);
    cv::Mat picture;
    cv::Mat(size, CV_32FC3, colours.data()).convertTo(picture, CV_8U, 255);
    write_image(options.output / fmt::format("{:04}.png", i), picture);
    progress.report({.step = i + 1, .rays = static_cast<double>(size.area())});
    if (interrupted() && i + 1 < count) {
      progress.end();
      throw Interrupted(fmt::format("stopped after {} of {} pictures", i + 1, count));
    }
  }
  progress.end();
}

}  // namespace vivant
