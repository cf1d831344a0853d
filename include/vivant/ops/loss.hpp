#pragma once
#include "vivant/graph/graph.hpp"

namespace vivant {

/// Scalar losses [1], means over all elements (over those of the live rows when x has a device-side count).
/// Optional `weights` [..., 1] multiply each row's terms; the mean still divides by the number of elements.
/// Gradients flow to x and target, not to weights.

/// mean |x - target|; the gradient at 0 is 0.
Value l1_loss(Value x, Value target, Value weights = {});
/// mean (x - target)^2.
Value l2_loss(Value x, Value target, Value weights = {});
/// mean of -log(e^-|w| + e^-|1 - w|) + log(1 + e^-1): draws rendering weights to 0 or 1, where it is 0
/// (LOLNeRF, Rebain et al. 2022, equation 8, with the constant that makes its minimum 0). The gradient at 0
/// and 1 is 0.
Value hard_loss(Value w);

}  // namespace vivant
