#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vivant/graph/graph.hpp"

namespace vivant {

/// The parameters of a model in one contiguous buffer with a named layout; so are their gradients and Adam
/// moments. First every module adds its parameters, then `allocate` puts them on the device, then graphs use
/// them by name. Each parameter starts at a multiple of 64 elements; the padding is zero.
class ParameterStore {
 public:
  static constexpr std::int64_t block = 64;  ///< elements that share one learning-rate group
  static constexpr std::uint8_t frozen = 255;

  struct Parameter {
    std::string name;
    Shape shape;
    int group = 0;            ///< index into the learning rates of the optimizer
    std::int64_t offset = 0;  ///< elements from the start of the buffers
  };

  /// Adds a parameter with its first values. Throws when the name is taken or after `allocate`.
  void add(const std::string& name, Shape shape, int group, std::span<const float> values);
  /// Creates the device buffers and uploads the first values; moments start at zero.
  void allocate(Device& device);

  const std::vector<Parameter>& parameters() const { return parameters_; }
  const Parameter& find(const std::string& name) const;
  /// Elements of each buffer, padding included.
  std::int64_t elements() const { return elements_; }

  /// The parameter as a value of a graph; the same value for every call with this graph.
  Value value(Graph& graph, const std::string& name) const;
  /// The values of all parameters whose name starts with `prefix`, in layout order.
  Values values(Graph& graph, const std::string& prefix = "") const;
  /// Makes the gradient of `name` be written into the gradient buffer.
  void place_gradient(Graph& graph, const std::string& name, Value gradient) const;

  /// Whole buffers as values of a graph: for the optimizer.
  Value all_values(Graph& graph) const;
  Value all_gradients(Graph& graph) const;
  Value all_first_moments(Graph& graph) const;
  Value all_second_moments(Graph& graph) const;
  /// The learning-rate group of each block of 64 elements; `frozen` where the name has none of the given
  /// prefixes.
  std::vector<std::uint8_t> group_table(const std::vector<std::string>& trained_prefixes) const;

  enum class Kind { value, first_moment, second_moment };
  std::vector<float> read(const std::string& name, Kind kind = Kind::value) const;
  void write(const std::string& name, std::span<const float> data, Kind kind = Kind::value);
  /// Sets the Adam moments of all parameters to zero, as at the start of a stage.
  void clear_moments();

 private:
  Value whole(Graph& graph, const std::string& name, const std::shared_ptr<Buffer>& buffer) const;
  const std::shared_ptr<Buffer>& buffer_of(Kind kind) const;

  std::vector<Parameter> parameters_;
  std::vector<float> first_values_;
  std::int64_t elements_ = 0;
  Device* device_ = nullptr;
  std::shared_ptr<Buffer> values_, gradients_, first_moments_, second_moments_;
};

/// First values for parameters, the same for the same seed and name whatever else a model holds.
class Initializer {
 public:
  explicit Initializer(std::uint64_t seed) : seed_(seed) {}
  /// Normal numbers of the given standard deviation.
  std::vector<float> normal(const std::string& name, std::int64_t elements, double deviation) const;
  /// He initialisation: standard deviation sqrt(2 / inputs).
  std::vector<float> he(const std::string& name, std::int64_t elements, std::int64_t inputs,
                        double scale = 1) const;

 private:
  std::uint64_t seed_;
};

}  // namespace vivant
