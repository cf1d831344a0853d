// The command line as a user meets it: exit codes, messages, and ops run by name.
#include <nlohmann/json.hpp>

#include "child_process.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/safetensors.hpp"

using namespace vivant;

namespace {

/// A usage error: exit code 2 and one line that holds `part`.
void check_usage_error(const std::string& arguments, const std::string& part) {
  const Finished run = run_vivant(arguments);
  CAPTURE(arguments);
  CAPTURE(run.err);
  CHECK(run.exit_code == 2);
  CHECK(contains(run.err, part));
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
}

HostTensor tensor(std::vector<std::int64_t> shape, const std::vector<float>& values) {
  return {std::move(shape), std::span<const float>(values)};
}

/// x [2, 3] . w [3, 1] + b [1], with a gradient of the output.
TensorFile linear_inputs() {
  TensorFile file;
  file.tensors["x"] = tensor({2, 3}, {1, 2, 3, 4, 5, 6});
  file.tensors["w"] = tensor({3, 1}, {1, 10, 100});
  file.tensors["b"] = tensor({1}, {-1});
  file.tensors["grad_y"] = tensor({2, 1}, {1, 2});
  return file;
}

Finished run_linear(const TemporaryFolder& folder, const TensorFile& file, const std::string& more = "") {
  write_safetensors(folder / "in.safetensors", file);
  return run_vivant("op run linear --in " + (folder / "in.safetensors").string() + " --out " +
                    (folder / "out.safetensors").string() + " " + more);
}

void check_linear_error(const TensorFile& file, const std::string& part, const std::string& more = "") {
  const TemporaryFolder folder;
  const Finished run = run_linear(folder, file, more);
  CAPTURE(run.err);
  CHECK(run.exit_code == 1);
  CHECK(contains(run.err, part));
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  CHECK_FALSE(std::filesystem::exists(folder / "out.safetensors"));
}

}  // namespace

TEST_CASE("command line: an option that would say nothing is refused") {
  for (const auto& [options, message] :
       {std::pair("--strength 0.5", "--strength is of a stylised film: give --style"),
        {"--keep-colour", "--keep-colour is of a stylised film: give --style"},
        {"--orbit-angle 9", "--orbit-angle is of an orbit: give --views orbit"},
        {"--motion-names names.json", "--motion-names is of a motion: give --motion"}}) {
    const Finished run = run_vivant(std::string("render nowhere -o film.mp4 ") + options);
    CHECK(run.exit_code == 2);
    CHECK(run.err == fmt::format("vivant: {}\n", message));
  }
}

TEST_CASE("command line: a style's weight is a number") {
  const std::string style = asset_path("styles/mosaic.jpg").string() + ":many";
  const Finished run = run_vivant("render nowhere -o film.mp4 --style " + style);
  CHECK(run.exit_code == 2);
  CHECK(run.err ==
        fmt::format("vivant: a style is IMAGE or IMAGE:WEIGHT with a weight above 0, not '{}'\n", style));
}

TEST_CASE("command line: every command has help with an example") {
  for (const std::string command :
       {"synth", "devices", "op list", "op show", "op run", "bench", "bench roofline", "tune"}) {
    const Finished run = run_vivant(command + " --help");
    CAPTURE(command);
    CHECK(run.exit_code == 0);
    CHECK(contains(run.out, "Example"));
    CHECK(contains(run.out, "vivant " + command));
  }
  CHECK(contains(run_vivant("--help").out, "--device-class"));
}

TEST_CASE("command line: wrong usage exits with 2 and one line") {
  check_usage_error("", "subcommand is required");
  check_usage_error("fly", "there is no command 'fly' (see `vivant --help`)");
  check_usage_error("op fly", "there is no command 'fly' (see `vivant op --help`)");
  check_usage_error("devices --frob", "--frob (see `vivant devices --help`)");
  check_usage_error("devices --device-class tpu", "tpu not in {cpu,gpu}");
  check_usage_error("devices --progress fancy", "unknown progress mode 'fancy'");
  check_usage_error("devices --device no-such-device", "'no-such-device': `vivant devices` lists");
  check_usage_error("op show no_such_op", "no op 'no_such_op'");
  check_usage_error("op run linear --in x", "--out is required");
  check_usage_error("synth", "--output is required");
  for (const std::string size : {"320", "320x", "x240", "320x240x3", "-3x4", "0x0", "axb", "99999999999x3"})
    check_usage_error("synth -o /nowhere --size " + size, "a size is WIDTHxHEIGHT");
  check_usage_error("bench no_such_op", "'no_such_op'");
}

TEST_CASE("command line: ops describe themselves as JSON") {
  CHECK(contains(run_vivant("op list").out, "linear"));
  const auto op = nlohmann::json::parse(run_vivant("op show linear").out);
  CHECK(op["name"] == "linear");
  CHECK(op["inputs"][1] ==
        nlohmann::json({{"name", "w"}, {"shape", "[K, N]"}, {"dtype", "f32"}, {"optional", false}}));
  CHECK(op["inputs"][2]["optional"] == true);
  CHECK(op["attributes"][0]["name"] == "activation");
  CHECK(op["attributes"][0]["default"] == "none");
}

TEST_CASE("command line: op run computes values and gradients on both device classes") {
  const TemporaryFolder folder;
  for (const std::string device_class : {"cpu", "gpu"}) {
    const Finished run = run_linear(folder, linear_inputs(), "--grad --device-class " + device_class);
    CAPTURE(run.err);
    REQUIRE(run.exit_code == 0);
    const TensorFile out = read_safetensors(folder / "out.safetensors");
    CHECK(out.tensors.size() == 4);
    CHECK(out.at("y", {2, 1}).as_floats() == std::vector<float>{320, 653});
    CHECK(out.at("grad_x", {2, 3}).as_floats() == std::vector<float>{1, 10, 100, 2, 20, 200});
    CHECK(out.at("grad_w", {3, 1}).as_floats() == std::vector<float>{9, 12, 15});
    CHECK(out.at("grad_b", {1}).as_floats() == std::vector<float>{3});
  }
  TensorFile without_bias = linear_inputs();
  without_bias.tensors.erase("b");
  without_bias.tensors["x"] = tensor({2, 3}, {-1, -2, -3, 4, 5, 6});
  const std::vector<double> wide = {1, 10, 100};
  without_bias.tensors["w"] = HostTensor({3, 1}, std::span<const double>(wide));  // any floating-point type
  REQUIRE(run_linear(folder, without_bias, "--attr activation=relu").exit_code == 0);
  CHECK(read_safetensors(folder / "out.safetensors").at("y").as_floats() == std::vector<float>{0, 654});
}

TEST_CASE("command line: op run refuses bad tensors with one line") {
  TensorFile file = linear_inputs();
  file.tensors.erase("w");
  check_linear_error(file, "no tensor 'w'");
  file = linear_inputs();
  file.tensors["w"] = tensor({4, 1}, {1, 2, 3, 4});
  check_linear_error(file, "[linear] weight has 4 input channels, x has 3");
  file.tensors["w"] = tensor({3}, {1, 2, 3});
  check_linear_error(file, "[linear] input w must have the shape [K, N], the file has F32 [3]");
  const std::vector<std::int32_t> integers = {1, 2, 3};
  file.tensors["w"] = HostTensor({3, 1}, std::span<const std::int32_t>(integers));
  check_linear_error(file, "[linear] input w must be f32 [K, N], the file has I32 [3, 1]");
  file = linear_inputs();
  file.tensors["bias"] = file.tensors["b"];
  check_linear_error(file, "does not know the tensor 'bias': it takes x, w, b, grad_y");
  file = linear_inputs();
  file.tensors["grad_y"] = tensor({3, 1}, {1, 2, 3});
  check_linear_error(file, "tensor 'grad_y' is F32 [3, 1], its shape must be [2, 1]", "--grad");
  file.tensors.erase("grad_y");
  check_linear_error(file, "gradients need grad_y", "--grad");
  const TemporaryFolder folder;
  check_usage_error("op run linear --in none --out none --attr activation", "takes name=value");
  check_usage_error("op run linear --in none --out none --attr color=red", "no attribute 'color'");
  check_usage_error("op run affine --in none --out none --attr scale=big",
                    "scale of the op affine is a number");
  CHECK(run_vivant("op run linear --in none --out none").exit_code == 1);
  CHECK(run_linear(folder, linear_inputs(), "--attr activation=tanh").exit_code == 2);
}

TEST_CASE("command line: synth makes a capture, and reports progress as JSON lines") {
  const TemporaryFolder folder;
  const std::string output = (folder / "walk").string();
  const Finished run = run_vivant("synth -o " + output + " --frames 3 --size 48x32 --progress json");
  CAPTURE(run.err);
  REQUIRE(run.exit_code == 0);
  CHECK(std::filesystem::exists(folder / "walk/transforms.json"));
  std::istringstream rows(run.err);
  std::string row, message;
  std::int64_t steps = 0, last = 0;
  while (std::getline(rows, row)) {
    const auto values = nlohmann::json::parse(row);
    message = values.value("message", "");
    if (!message.empty()) continue;
    CHECK(values["stage"] == "synth");
    last = values["step"];
    steps = values["steps"];
  }
  CHECK(last == steps);
  CHECK(steps > 3);
  CHECK(contains(message, "holds a capture of 3 frames"));
  const Finished again = run_vivant("synth -o " + output + " --frames 3 --size 48x32");
  CHECK(again.exit_code != 0);
  CHECK(std::count(again.err.begin(), again.err.end(), '\n') == 1);
}
