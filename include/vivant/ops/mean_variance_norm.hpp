#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Mean and standard deviation of every channel over all (live) rows.
struct ChannelStatistics {
  Value mean, deviation;  ///< [C]
};

/// Over the rows of x [..., C], at least two: deviation = sqrt(unbiased variance + 1e-5), as AdaAttN has it.
/// Two passes over chunks in a fixed order: stable for means far larger than the deviation.
ChannelStatistics channel_statistics(Value x);

/// (x - mean) / deviation by channel, with the statistics of x itself; the gradient goes through them.
Value mean_variance_norm(Value x);
/// The same with given statistics, learned running values for example; they get no gradient.
Value mean_variance_norm(Value x, const ChannelStatistics& given);

/// running += momentum * (batch - running), for mean and deviation, when the graph runs. `running` holds
/// inputs or external values. `stop`: i32 or absent; nothing is updated when its first element is not 0.
void update_running_statistics(const ChannelStatistics& running, const ChannelStatistics& batch,
                               double momentum, Value stop = {});

}  // namespace vivant
