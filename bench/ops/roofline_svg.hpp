#pragma once
#include <span>
#include <string>

#include "bench/ops/op_benchmark.hpp"

namespace vivant::bench {

/// A picture of the ops below the device's limits: rate against arithmetic intensity, both logarithmic, with
/// a panel for ops without arithmetic and a numbered legend.
std::string roofline_svg(std::span<const OpTiming> timings, const Limits& limits, const std::string& device);

}  // namespace vivant::bench
