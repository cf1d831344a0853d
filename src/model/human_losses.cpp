#include "vivant/model/human_losses.hpp"

#include "vivant/ops/elementwise.hpp"
#include "vivant/ops/loss.hpp"
#include "vivant/ops/reduction.hpp"

namespace vivant {
namespace {

constexpr double steepness = 1e4;  // per metre: a label turns from 0 to 1 within a tenth of a millimetre
constexpr double range_strength = 5;

Value opacity(Value density, double length) {
  return affine(activate(affine(density, -length), Activation::truncated_exp), -1, 1);
}

}  // namespace

Value over_background(Value colour, Value alpha, Value background) {
  return add(colour, multiply(background, affine(alpha, -1, 1)));
}

Value masked_colour_loss(Value colour, Value mask, Value target) { return l1_loss(colour, target, mask); }

Value alpha_loss(Value alpha, Value mask) {
  return l1_loss(alpha, affine(alpha.graph->detach(alpha), 0, 1), mask);
}

BodyLabels body_labels(Value signed_distance, double inside_band, double outside_band) {
  const Value inside = clamp(affine(signed_distance, -steepness, -steepness * inside_band), 0, 1);
  const Value outside = clamp(affine(signed_distance, steepness, -steepness * outside_band), 0, 1);
  return {inside, add(inside, outside)};
}

Value body_loss(Value density, const BodyLabels& labels, double length) {
  return l1_loss(length > 0 ? opacity(density, length) : density, labels.inside, labels.decided);
}

Value edge_loss(Value density, Value lengths) {
  const Value depth = sum_channels(multiply(density.graph->reshape(density, lengths.shape()), lengths));
  return hard_loss(opacity(depth, 1));
}

Value surface_colour_loss(Value a, Value b) {
  const Value in_range = a.graph->detach(clamp(a, 0, 1));
  return add(l1_loss(a, b), affine(l1_loss(a, in_range), range_strength));
}

}  // namespace vivant
