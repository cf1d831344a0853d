#pragma once
#include <string>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// relu; leaky_relu (slope 0.01); softplus log(1 + e^x); sigmoid; truncated_exp e^min(x, 12), whose slope
/// stays within [e^-12, e^12].
enum class Activation { none, relu, leaky_relu, softplus, sigmoid, truncated_exp };

std::string_view name_of(Activation activation);
/// Throws UsageError for an unknown name.
Activation activation_from(const std::string& name);

/// y = f(x), any shape.
Value activate(Value x, Activation activation);
/// grad_x = grad_y * f'(x), from y = f(x): what fused ops use in their gradients.
Value activation_gradient(Value y, Value grad_y, Activation activation);

/// y = scale * x + shift.
Value affine(Value x, double scale, double shift = 0);

/// y = x held within [low, high]; outside of it the gradient is 0.
Value clamp(Value x, double low, double high);

/// a + b, a - b, a * b. `b` has a's shape, or is broadcast over it: [C] over rows, [..., 1] over channels,
/// [1] over everything.
Value add(Value a, Value b);
Value subtract(Value a, Value b);
Value multiply(Value a, Value b);

}  // namespace vivant
