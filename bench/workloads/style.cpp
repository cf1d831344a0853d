// The workloads of stylisation: VGG-19 (W4), a frame (W3), a training step (W5).
#include "style_network.hpp"
#include "vivant/nn/vgg19.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/mean_variance_norm.hpp"

namespace vivant::bench {
namespace {

constexpr std::uint64_t seed = 1;

/// The published network up to relu4_1; `part`: forward, or forward and gradient: to the image.
struct Vgg final : Workload {
  Vgg(Device& device, const Sizes& sizes) : Workload(device), vgg(device, Vgg19::Form::plain) {
    const std::int64_t side = sizes.at("side");
    const Value image = input("image", {side, side, 3}, {0, 1});
    const Value features = vgg.features(image, {"relu4_1"}).at("relu4_1");
    std::map<std::string, Value> outputs = {{"features", features}};
    if (sizes.at("part") != "forward") {
      const Value g = input("g", features.shape());
      outputs["gradient of image"] = differentiate(graph_, {features}, {g}, {image}).front();
    }
    prepare(outputs);
  }
  Vgg19 vgg;
};

/// What both style workloads share; one trains, the other does not.
template <typename Kind>
struct Style : Kind {
  Style(Device& device, const Sizes& sizes)
      : Kind(device), network(this->store_, Initializer(seed)), tokens(sizes.at("tokens")) {
    this->store_.allocate(device);
    this->publish(this->store_);
  }
  Value stylised(std::int64_t height, std::int64_t width) {
    const Value features = this->input("features", {height, width, StyleNetwork::channels}, {0, 2});
    return network(this->graph_, features,
                   {.mean = this->input("mean", {StyleNetwork::channels}, {-0.1, 0.1}),
                    .deviation = this->input("deviation", {StyleNetwork::channels}, {0.8, 1.2}),
                    .keys = this->input("keys", {tokens, StyleNetwork::channels}, {-1.7, 1.7}),
                    .values = this->input("values", {tokens, StyleNetwork::channels}, {0, 2})});
  }
  StyleNetwork network;
  std::int64_t tokens;
};

struct Stylise final : Style<Workload> {
  Stylise(Device& device, const Sizes& sizes) : Style(device, sizes) {
    prepare({{"image", stylised(sizes.at("height"), sizes.at("width"))}});
  }
};

/// Means and deviations of relu2_1 to relu5_1 against those of a style, backward, Adam.
struct StyleStep final : Style<TrainingWorkload> {
  StyleStep(Device& device, const Sizes& sizes) : Style(device, sizes), vgg(device, Vgg19::Form::plain) {
    const Value image = stylised(sizes.at("side"), sizes.at("side"));
    Value loss;
    for (const auto& [layer, features] : vgg.features(image, {"relu2_1", "relu3_1", "relu4_1", "relu5_1"})) {
      const ChannelStatistics found = channel_statistics(features);
      const auto target = [&](const char* what) {
        return input(layer + what, {features.shape().channels()}, {0, 100});
      };
      const Value error =
          add(l2_loss(found.mean, target(" mean")), l2_loss(found.deviation, target(" deviation")));
      loss = loss ? add(loss, error) : error;
    }
    train(loss, {""});
    prepare({{"image", image}, {"loss", loss}});
  }
  Vgg19 vgg;
};

}  // namespace

WorkloadTable style_workloads() {
  return {{"vgg", make<Vgg>}, {"stylise", make<Stylise>}, {"style step", make<StyleStep>}};
}

}  // namespace vivant::bench
