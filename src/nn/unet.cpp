#include "vivant/nn/unet.hpp"

#include "vivant/ops/concat.hpp"
#include "vivant/ops/max_pool2d.hpp"
#include "vivant/ops/upsample.hpp"

namespace vivant {

UNet::UNet(ParameterStore& store, const Initializer& initializer, const std::string& name, std::int64_t in,
           const std::vector<std::int64_t>& widths, std::int64_t out, int group)
    : out_(store, initializer, name + ".out", widths.front(), out, group, {.scale = 0.5, .bias = 1}) {
  const auto level = [&](const std::string& part, std::int64_t from, std::int64_t to) {
    return Level{ConvLayer(store, initializer, name + part + ".first", from, to, group),
                 ConvLayer(store, initializer, name + part + ".second", to, to, group)};
  };
  for (std::size_t i = 0; i < widths.size(); ++i)
    down_.push_back(level(fmt::format(".down{}", i), i == 0 ? in : widths[i - 1], widths[i]));
  for (std::size_t i = widths.size() - 1; i-- > 0;) {
    const std::string part = fmt::format(".up{}", i);
    up_.push_back(
        {LinearLayer(store, initializer, name + part + ".rise", widths[i + 1], 4 * widths[i], group, {}),
         level(part, 2 * widths[i], widths[i])});
  }
}

Value UNet::operator()(Graph& graph, Value x) const {
  const auto apply = [&](const Level& level, Value value) {
    return level.second(graph, level.first(graph, value, Padding::zero, Activation::relu), Padding::zero,
                        Activation::relu);
  };
  Values skips;
  for (const Level& level : down_) {
    if (!skips.empty()) x = max_pool2d(x);
    x = apply(level, x);
    skips.push_back(x);
  }
  skips.pop_back();
  for (const Rise& rise : up_) {
    x = concat({depth_to_space(rise.up(graph, x)), skips.back()});
    skips.pop_back();
    x = apply(rise.level, x);
  }
  return out_(graph, x);
}

}  // namespace vivant
