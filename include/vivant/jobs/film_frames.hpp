#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "vivant/jobs/film_renderer.hpp"
#include "vivant/jobs/film_stylizer.hpp"
#include "vivant/jobs/flow.hpp"
#include "vivant/jobs/temporal_mean.hpp"

namespace vivant {

/// The frames of a film in one look or several, in any order: each depends on its own shot and, when it is
/// painted, on those `Film::reach` before and after it, not on what was asked before. Frames asked in order
/// share the work of their neighbours.
class FilmFrames {
 public:
  /// Films of `layers` ("both", "scene", "human"); see FilmRenderer and FilmStylizer, whose errors it throws.
  /// Without looks there are only rendered frames. Everything given must outlive it.
  FilmFrames(Device& device, const OpenRun& run, const OpenRun& scene, const Film& film,
             const std::string& layers, const std::vector<Look>& looks);
  ~FilmFrames();

  /// The shot as the fields show it.
  const LayerFrame& rendered(int shot);
  /// The shot's geometry.
  const SurfaceView& surface(int shot);
  /// The shot in the look of this index: the temporal mean (temporal_mean.hpp) of the painted shot and its
  /// neighbours, along the better of two flows at each pixel, with the paintings' brushwork on it. Layers
  /// with styles of their own are two such means, put together by the person's share; a layer without a style
  /// is as rendered.
  LayerFrame stylised(int shot, std::size_t look);
  /// The same without the mean: the shot as it is painted alone.
  LayerFrame painted_alone(int shot, std::size_t look);
  /// The same mean of another film's pictures (CV_8UC3, RGB, of the shots 0, 1, ...), of one of these shots.
  cv::Mat averaged(int shot, const std::vector<cv::Mat>& pictures);

 private:
  struct Entry;
  Entry& entry(int shot);
  void forget_all_but(int first, int last);
  const std::vector<float>& painted(int shot, std::size_t look, Layer layer);
  /// By the geometry, and by DIS on the rendered pictures: fields of short trainings know little of depth.
  struct Flows {
    cv::Mat geometry, dis;
  };
  Flows flows(int from, int to);
  /// Where the points of a shot are in another one, and how far to trust it.
  struct Match {
    cv::Mat flow, trust;
  };
  Match matched(int from, int to, const Flows& forward, const Flows& backward);
  const Match& match(int from, int to);
  /// A film's picture of a shot, CV_32FC3; empty where there is none.
  using PictureOfShot = std::function<cv::Mat(int shot)>;
  cv::Mat mean(int shot, const PictureOfShot& picture);
  /// The layers of a look that `picture` gives, put together.
  LayerFrame composed(int shot, std::size_t look, const std::function<cv::Mat(Layer)>& picture);
  cv::Mat painted_picture(int shot, std::size_t look, Layer layer);
  /// The picture of a layer with the brushwork of the look.
  cv::Mat with_brushwork(int shot, std::size_t look, Layer layer, const cv::Mat& picture);

  const Film& film_;
  const Body* body_;
  std::vector<Look> looks_;
  FilmRenderer renderer_;
  std::optional<FilmStylizer> stylizer_;
  SurfaceFlow surface_flow_;
  std::map<int, Entry> entries_;
  std::map<std::pair<int, int>, Match> matches_;
  std::optional<std::pair<int, SurfaceTexture>> texture_;  ///< of the shot that was asked last
};

}  // namespace vivant
