#include "vivant/model/read_out.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace vivant {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::int64_t C = Stylizer::features, colours_count = 3;
constexpr double read_out_ridge = 1e-3, whitening_ridge = 0.05;  // of the features' mean variance

/// The best linear map from features to something, and the moments it comes from.
struct Regression {
  Eigen::VectorXd feature_mean;
  Eigen::Vector3d colour_mean;
  Eigen::MatrixXd covariance;  ///< [C, C]
  Eigen::MatrixXd weights;     ///< [C, 3]
  double error = 0;
};

Regression regress(const Eigen::MatrixXd& features, const Eigen::MatrixXd& colours) {
  Regression r;
  const double count = static_cast<double>(features.rows());
  r.feature_mean = features.colwise().mean();
  r.colour_mean = colours.colwise().mean();
  const Eigen::MatrixXd x = features.rowwise() - r.feature_mean.transpose(),
                        y = colours.rowwise() - r.colour_mean.transpose();
  r.covariance = x.transpose() * x / count;
  const double ridge = read_out_ridge * r.covariance.trace() / C;
  r.weights =
      (r.covariance + ridge * Eigen::MatrixXd::Identity(C, C)).ldlt().solve(x.transpose() * y / count);
  r.error = (x * r.weights - y).squaredNorm() / (count * colours_count);
  return r;
}

/// rotation * covariance^-1/2, transposed: [C, C] as weights [in, out].
Eigen::MatrixXd rotated_whitening(const Regression& r, const Initializer& initializer,
                                  const std::string& name) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(r.covariance);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0.0);
  const Eigen::VectorXd inverse = (values.array() + whitening_ridge * values.mean()).rsqrt();
  const std::vector<float> normal = initializer.normal(name + ".whitening", C * C, 1);
  const Eigen::MatrixXd random = Eigen::Map<const Matrix>(normal.data(), C, C).cast<double>();
  const Eigen::MatrixXd rotation = Eigen::HouseholderQR<Eigen::MatrixXd>(random).householderQ();
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() * rotation;
}

/// Makes a layer [taps, C, out] the first `out` columns of weights [C, C] at its middle tap, and their bias.
void write_centre(ParameterStore& store, const std::string& layer, const Eigen::MatrixXd& weights,
                  const Eigen::VectorXd& bias) {
  const Shape shape = store.find(layer + ".weight").shape;
  const std::int64_t out = shape.channels(), taps = shape.elements() / (C * out);
  Matrix all = Matrix::Zero(taps * C, out);
  all.middleRows(taps / 2 * C, C) = weights.leftCols(out).cast<float>();
  const Eigen::VectorXf first = bias.head(out).cast<float>();
  store.write(layer + ".weight", {all.data(), static_cast<std::size_t>(all.size())});
  store.write(layer + ".bias", {first.data(), static_cast<std::size_t>(first.size())});
}

/// Makes outputs 0 to 2 of a layer copy its inputs 0 to 2. weights [taps, in, out]; the middle tap copies.
void hand_on_colours(ParameterStore& store, const std::string& layer, bool keep_rest) {
  const Shape shape = store.find(layer + ".weight").shape;
  std::vector<float> weights = store.read(layer + ".weight");
  const std::int64_t out = shape.channels(), in = shape[-2], taps = shape.elements() / (in * out);
  for (std::int64_t tap = 0; tap < taps; ++tap)
    for (std::int64_t i = 0; i < in; ++i)
      for (std::int64_t o = 0; o < colours_count; ++o) {
        float& weight = weights[(tap * in + i) * out + o];
        if (i < colours_count)
          weight = tap == taps / 2 && i == o ? 1.0f : 0.0f;
        else if (!keep_rest)
          weight = 0;
      }
  store.write(layer + ".weight", weights);
}

}  // namespace

double start_read_out(ParameterStore& store, const Stylizer& stylizer, const Initializer& initializer,
                      std::span<const float> features, std::span<const float> colours) {
  const auto count = static_cast<Eigen::Index>(colours.size() / colours_count);
  const Regression r = regress(Eigen::Map<const Matrix>(features.data(), count, C).cast<double>(),
                               Eigen::Map<const Matrix>(colours.data(), count, colours_count).cast<double>());
  Eigen::MatrixXd weights = rotated_whitening(r, initializer, stylizer.name());
  weights.leftCols(colours_count) = r.weights;
  Eigen::VectorXd bias = -(weights.transpose() * r.feature_mean);
  bias.head(colours_count) += r.colour_mean;

  const std::vector<std::string> layers =
      stylizer.options().mirrored
          ? std::vector<std::string>{"decoder0", "decoder1", "decoder2", "decoder3", "decoder4"}
          : std::vector<std::string>{"psi0", "psi1", "decoder0", "decoder1", "decoder2", "decoder3"};
  const std::string name = stylizer.name() + ".";
  write_centre(store, name + layers.front(), weights, bias);
  for (std::size_t i = 1; i < layers.size(); ++i)
    hand_on_colours(store, name + layers[i], i + 1 == layers.size());
  return r.error;
}

}  // namespace vivant
