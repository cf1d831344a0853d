#pragma once
#include <memory>
#include <vector>

#include "jobs/training_pictures.hpp"
#include "vivant/graph/executor.hpp"
#include "vivant/model/style_losses.hpp"

namespace vivant {

/// A pool of style targets made of random crops of paintings: making one costs more than a training step, so
/// each serves many.
class StyleTargets {
 public:
  /// Everything must outlive it.
  StyleTargets(Device& device, const Stylizer& stylizer, const Vgg19& vgg, const TrainingPictures& paintings,
               std::uint64_t seed);

  /// Inputs of a training graph for one target.
  StyleTarget as_inputs(Graph& graph) const { return target_.as_inputs(graph); }
  /// Writes a random one of the targets that are in the pool at `step` into these inputs. The pool is a
  /// function of the step alone, so that an interrupted training finds it again.
  void write(Executor& executor, const StyleTarget& inputs, KeyedRandom& random, std::int64_t step);

 private:
  void make(std::int64_t number);

  const TrainingPictures& paintings_;
  std::uint64_t seed_;
  Graph graph_;
  Value painting_;
  StyleTarget target_;
  std::unique_ptr<Executor> executor_;
  std::vector<std::vector<std::vector<float>>> pool_;  ///< targets, each with all its values
  std::int64_t newest_ = -1;                           ///< the first target that is not made yet
};

/// Records stage 3's losses of a crop: content = phi(F_c) [h, w, 256] is stylised with the given statistics
/// and decoded with the detail of `rgb` [4h, 4w, 3], the unstylised picture, times `detail_amount` [1].
StyleLosses losses_of_stylised(Graph& graph, const Stylizer& stylizer, const Vgg19& vgg, Value content,
                               Value rgb, const StyleFeatures& rgb_features,
                               const ContentStatistics& statistics, Value detail_amount,
                               const StyleTarget& target, const ChannelScales& scales);

}  // namespace vivant
