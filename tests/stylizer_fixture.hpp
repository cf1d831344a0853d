#pragma once
#include <opencv2/core.hpp>

#include "jobs/training_pictures.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/io/image.hpp"
#include "vivant/model/stylizer.hpp"
#include "vivant/nn/vgg19.hpp"

namespace vivant {

/// A stylizer with random weights, and VGG-19.
struct StylizerFixture {
  Device device;
  Initializer initializer{7};
  ParameterStore store;
  Stylizer stylizer;
  Vgg19 vgg;

  explicit StylizerFixture(StylizerOptions options = {})
      : stylizer(store, initializer, options), vgg(device) {
    store.allocate(device);
  }

  std::vector<float> features(const cv::Mat& picture) {
    Graph graph;
    const Value input = graph.input("picture", {picture.rows, picture.cols, 3});
    const Value relu3_1 = vgg.features(input, {"relu3_1"}).at("relu3_1");
    Executor executor(device, graph, {relu3_1});
    executor.write(input, floats_of(picture));
    executor.run();
    return executor.read(relu3_1);
  }

  std::vector<float> reconstruct(const cv::Mat& picture) {
    Graph graph;
    const Value rgb = graph.input("rgb", {picture.rows, picture.cols, 3});
    const Value seen = graph.input("features", {picture.rows / 4, picture.cols / 4, 256});
    const Value image = stylizer.reconstruct(graph, seen, rgb);
    Executor executor(device, graph, {image});
    executor.write(rgb, floats_of(picture));
    executor.write(seen, features(picture));
    executor.run();
    return executor.read(image);
  }
};

}  // namespace vivant
