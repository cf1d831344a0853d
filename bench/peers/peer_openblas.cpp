// GEMM in OpenBLAS.
#include <cblas.h>

#include "peer_server.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant::peers {
namespace {

Peer load(const nlohmann::json& request, const TensorFile& inputs) {
  if (request.at("workload") != "product" || request.at("mode") != "fp32")
    fail("OpenBLAS takes part in products in fp32");
  const int rows = request.at("rows"), in = request.at("in"), out = request.at("out");
  struct State {
    std::vector<float> x, w, g, y, grad_x, grad_w;
  };
  const auto state = std::make_shared<State>(
      State{inputs.at("x").as_floats(), inputs.at("w").as_floats(), inputs.at("g").as_floats(),
            std::vector<float>(rows * out), std::vector<float>(rows * in), std::vector<float>(in * out)});
  if (request.at("part") == "forward")
    return {[=] {
              cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, rows, out, in, 1, state->x.data(), in,
                          state->w.data(), out, 0, state->y.data(), out);
            },
            [=] {
              TensorFile file;
              file.tensors["y"] = HostTensor({rows, out}, std::span<const float>(state->y));
              return file;
            }};
  return {[=] {
            cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, rows, in, out, 1, state->g.data(), out,
                        state->w.data(), out, 0, state->grad_x.data(), in);
            cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, in, out, rows, 1, state->x.data(), in,
                        state->g.data(), out, 0, state->grad_w.data(), out);
          },
          [=] {
            TensorFile file;
            file.tensors["gradient of x"] = HostTensor({rows, in}, std::span<const float>(state->grad_x));
            file.tensors["gradient of w"] = HostTensor({in, out}, std::span<const float>(state->grad_w));
            return file;
          }};
}

}  // namespace
}  // namespace vivant::peers

int main() { vivant::peers::serve(vivant::peers::load); }
