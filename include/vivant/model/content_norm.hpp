#pragma once
#include "vivant/model/frame_stylizer.hpp"
#include "vivant/nn/parameters.hpp"

namespace vivant {

/// The running statistics of norm(c) over what a capture's fields render:
/// learned once, then the same for every frame, view and tile, so that nothing flickers. Parameters
/// `content_norm.feature_mean` [256], `.feature_deviation` [256], `.luma_mean` [1] and `.luma_deviation` [1],
/// which no optimizer trains.
class RunningContentNorm {
 public:
  /// Registers the parameters in a store that is not allocated yet.
  explicit RunningContentNorm(ParameterStore& store);

  ContentStatistics value(Graph& graph) const;
  /// Moves them towards the statistics of a batch when the graph runs: content = phi(F_c) [h, w, 256],
  /// luma [h, w, 1]. `stop`: i32, see update_running_statistics.
  void update(const ContentStatistics& batch, Value stop) const;

  ContentNorm read() const;
  void write(const ContentNorm& norm) const;

 private:
  ParameterStore* store_;
};

}  // namespace vivant
