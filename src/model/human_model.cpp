#include "vivant/model/human_model.hpp"

#include "vivant/ops/concat.hpp"
#include "vivant/ops/gather.hpp"
#include "vivant/ops/positional_encoding.hpp"
#include "vivant/ops/rays.hpp"

namespace vivant {
namespace {

using Eigen::Vector3d;

constexpr double prior_width = 0.03, prior_strength = 2;  // metres; what is added a width inside of the body
constexpr double code_scale = 0.1;                        // codes are of order 1, corrections of centimetres
constexpr double root_extent = 1.2;                       // metres around the root that E's encoding spans
constexpr const char *error_codes_name = "human.error_codes", *bone_codes_name = "human.bone_codes";

/// The canonical vertices in plane coordinates, for planes that encode the voxels near the surface alone.
std::vector<float> surface_points(const HumanOptions& options, const BodyModel& body) {
  std::vector<float> points;
  if (options.field.encoding != Encoding::occupied) return points;
  const Box& box = body.canonical_box();
  for (const Vector3d& vertex : body.canonical_vertices())
    for (int axis = 0; axis < 3; ++axis)
      points.push_back(static_cast<float>(2 * (vertex[axis] - box.min[axis]) / box.size()[axis] - 1));
  return points;
}

}  // namespace

HumanModel::HumanModel(Device& device, ParameterStore& store, const Initializer& initializer,
                       const HumanOptions& options, Body body, int frames)
    : store_(&store),
      options_(options),
      body_(std::move(body), options.canonical, options.box_margin),
      canonical_joints_(posed_joints(
          body_.body(),
          joint_transforms(body_.body(), canonical_pose(body_.body(), options.canonical), Vector3d::Zero()))),
      frames_(frames),
      field_(device, store, initializer, "human", options.field, surface_points(options, body_)) {
  if (options.error_correction) {
    std::int64_t in = 3 * (1 + 2 * options.error_frequencies);
    for (int layer = 0; layer < options.error_layers; ++layer, in = options.error_width)
      error_layers_.emplace_back(store, initializer, fmt::format("human.error{}", layer), in,
                                 options.error_width, group_heads, LinearLayer::Options{});
    error_layers_.emplace_back(store, initializer, "human.error_out", in, 3, group_heads,
                               LinearLayer::Options{.scale = 0});
    error_layers_.emplace_back(store, initializer, "human.error_code", options.error_codes,
                               options.error_width, group_heads, LinearLayer::Options{.has_bias = false});
    const std::int64_t numbers = static_cast<std::int64_t>(frames) * options.error_codes;
    store.add(error_codes_name, {frames, options.error_codes}, group_codes,
              std::vector<float>(numbers, 0.0f));
  }
  if (options.bone_corrections) {
    const std::int64_t joints = body_.body().joint_count();
    store.add(bone_codes_name, {frames, joints, 6}, group_codes,
              std::vector<float>(frames * joints * 6, 0.0f));
  }
}

FrameCodes with_constant_copies(Graph& graph, const FrameCodes& codes) {
  const auto twice = [&](Value rows) {
    const Value flat = graph.reshape(rows, {1, rows.elements()});
    return concat({flat, graph.detach(flat)});
  };
  FrameCodes both;
  if (const Value rows = codes.error)
    both.error = graph.reshape(twice(rows), {2 * rows.shape()[0], rows.shape()[1]});
  if (const Value rows = codes.bones)
    both.bones = graph.reshape(twice(rows), {2 * rows.shape()[0], rows.shape()[1], rows.shape()[2]});
  return both;
}

FrameCodes HumanModel::codes(Graph& graph) const {
  FrameCodes codes;
  if (options_.error_correction) codes.error = store_->value(graph, error_codes_name);
  if (options_.bone_corrections) codes.bones = store_->value(graph, bone_codes_name);
  return codes;
}

SkinTables HumanModel::skin_tables(Graph& graph) const {
  const auto table = [&](const std::string& name, std::int64_t columns, const auto& numbers) {
    return graph.named("skin " + name, [&] {
      return graph.constant({static_cast<std::int64_t>(numbers.size()) / columns, columns},
                            std::span(numbers));
    });
  };
  const Body& body = body_.body();
  std::vector<std::int32_t> triangles, joints(body.skin_joints.begin(), body.skin_joints.end());
  std::vector<double> centres;
  for (const auto& triangle : body.triangles)
    triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  for (const Vector3d& joint : canonical_joints_) centres.insert(centres.end(), joint.begin(), joint.end());
  return {.triangles = table("triangles", 3, std::as_const(triangles)),
          .joints = table("joints", body.influences, std::as_const(joints)),
          .weights = table("weights", body.influences, body.skin_weights),
          .centres = table("centres", 3, std::as_const(centres))};
}

Value HumanModel::error_correction(Graph& graph, const HumanSamples& samples, Value codes) const {
  const Graph::Scope scope(graph, "human.error");
  const int layers = options_.error_layers;
  const Value place = options_.error_input == ErrorInput::observed ? affine(samples.root, 1 / root_extent)
                                                                   : in_canonical_box(samples.points);
  Value x = error_layers_[0](graph, positional_encoding(place, options_.error_frequencies));
  x = activate(add(x, gather_rows(error_layers_[layers + 1](graph, codes), samples.frame)), Activation::relu);
  std::vector<MlpLayer> rest;
  rest.reserve(layers);
  for (int layer = 1; layer <= layers; ++layer) rest.push_back(error_layers_[layer].in_mlp(graph));
  return mlp(x, rest);
}

Value HumanModel::correction(Graph& graph, const HumanSamples& samples, const FrameCodes& codes,
                             Value fade) const {
  Value sum;
  if (options_.bone_corrections)
    sum = bone_correction(samples.points, samples.face, samples.barycentric, samples.frame, codes.bones,
                          skin_tables(graph));
  if (options_.error_correction) {
    const Value error = error_correction(graph, samples, codes.error);
    sum = sum ? add(sum, error) : error;
  }
  return sum ? multiply(affine(sum, code_scale), fade) : sum;
}

Value HumanModel::features(Graph& graph, Value planes, Value canonical) const {
  return field_.features(graph, planes, in_canonical_box(canonical));
}

Value HumanModel::in_canonical_box(Value points) const {
  const Box& box = body_.canonical_box();
  return normalise_to_box(points, array_of(box.centre()), array_of(0.5 * box.size()));
}

Value HumanModel::density(Graph& graph, Value features, Value signed_distance) const {
  Value logit = field_.density_logit(graph, features);
  if (options_.distance_prior) {
    const Value prior = clamp(affine(signed_distance, -1 / prior_width), -3, 1);
    logit = add(logit, affine(prior, prior_strength));
  }
  return activate(logit, options_.field.density_activation);
}

Value HumanModel::hidden(Graph& graph, Value features, const Facing& facing, Output output) const {
  return hidden_units(field_.units_of_samples(graph, features, facing, output));
}

HumanFieldSamples HumanModel::query(Graph& graph, Value planes, const HumanSamples& samples,
                                    const FrameCodes& codes, Value fade, Value keep, Output output) const {
  const Graph::Scope scope(graph, "human");
  HumanFieldSamples result{.depths = samples.depths, .deltas = samples.deltas, .ids = samples.ids};
  result.correction = correction(graph, samples, codes, fade);
  const Value points = result.correction ? add(samples.points, result.correction) : samples.points;
  const Value field_features = features(graph, planes, points);
  result.row_density = density(graph, field_features, samples.signed_distance);
  result.density = graph.reshape(
      scatter_rows(result.row_density, samples.ids, samples.depths.elements(), IdOrder::ascending),
      samples.depths.shape());
  const Facing facing{.directions = samples.directions, .keep = keep, .normals = samples.normals};
  result.units = field_.units_of_samples(graph, field_features, facing, output);
  result.units.rows = samples.rows;
  return result;
}

HumanModel::CodeRow HumanModel::mixed_codes(const std::vector<std::pair<int, double>>& rows) const {
  const auto mix = [&](const std::string& name) {
    const std::vector<float> all = store_->read(name);
    const std::size_t width = all.size() / frames_;
    std::vector<double> sum(width, 0.0);
    for (const auto& [row, weight] : rows)
      for (std::size_t k = 0; k < width; ++k) sum[k] += weight * all[row * width + k];
    return std::vector<float>(sum.begin(), sum.end());
  };
  CodeRow row;
  if (options_.error_correction) row.error = mix(error_codes_name);
  if (options_.bone_corrections) row.bones = mix(bone_codes_name);
  return row;
}

void HumanModel::write_codes(const std::vector<CodeRow>& rows) {
  const auto write = [&](const std::string& name, std::vector<float> CodeRow::*codes) {
    std::vector<float> all;
    for (const CodeRow& row : rows) all.insert(all.end(), (row.*codes).begin(), (row.*codes).end());
    store_->write(name, all);
  };
  if (options_.error_correction) write(error_codes_name, &CodeRow::error);
  if (options_.bone_corrections) write(bone_codes_name, &CodeRow::bones);
}

HumanModel::CodeRow HumanModel::mean_codes() const {
  std::vector<std::pair<int, double>> rows;
  rows.reserve(frames_);
  for (int frame = 0; frame < frames_; ++frame) rows.emplace_back(frame, 1.0 / frames_);
  return mixed_codes(rows);
}

}  // namespace vivant
