// Op benchmarks and the device's limits: the counts, the kernels behind the limits, the picture, the command.
#include <nlohmann/json.hpp>
#include <numeric>

#include "bench/ops/label_placer.hpp"
#include "bench/ops/measure.hpp"
#include "bench/ops/roofline_svg.hpp"
#include "child_process.hpp"
#include "environment.hpp"

using namespace vivant;

namespace {

Device device_of_class(const std::string& name) { return Device(DeviceOptions{"", name, false, ""}); }

void run(Device& device, const Command& command) {
  device.launch(command.kernel, command.name, command.global, command.local);
}

std::vector<float> floats_in(Device& device, const Buffer& buffer) {
  std::vector<float> data(buffer.bytes() / sizeof(float));
  device.read(buffer, data.data(), buffer.bytes());
  return data;
}

/// first, first + 1, ... below 251, again and again: sums of these are exact.
Buffer counting(Device& device, std::size_t bytes, std::size_t first) {
  std::vector<float> data(bytes / sizeof(float));
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<float>((i + first) % 251);
  Buffer buffer = device.allocate(bytes);
  device.write(buffer, data.data(), bytes);
  return buffer;
}

bool is_xml(const std::filesystem::path& file) {
  return run_command("python3 -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' " +
                     file.string())
             .exit_code == 0;
}

void check_error(const std::string& arguments, int exit_code, const std::string& part) {
  const Finished finished = run_vivant(arguments);
  CAPTURE(finished.err);
  CHECK(finished.exit_code == exit_code);
  CHECK(contains(finished.err, part));
  CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 1);
}

}  // namespace

TEST_CASE("bench: launches and allocations are counted per run") {
  Device device;
  const Buffer y = device.allocate(sizeof(float));
  const Command touch = bench::touch(device, y);
  const bench::Cost cost = bench::measure(
      device, "probe",
      [&] {
        for (int i = 0; i < 3; ++i) run(device, touch);
        for (int i = 0; i < 2; ++i) device.allocate(16);
      },
      true);
  CHECK(cost.launches == doctest::Approx(3));
  CHECK(cost.allocations == doctest::Approx(2));
  CHECK(cost.fastest_seconds > 0);
  CHECK(cost.seconds >= cost.fastest_seconds);
  CHECK(cost.seconds < 1);
}

TEST_CASE("bench: work that fails is reported, and the next is measured") {
  Device device;
  int runs = 0;
  CHECK_THROWS_WITH(bench::measure(
                        device, "fails", [&] { ++runs > 1 ? fail("no more") : void(); }, true),
                    "no more");
  CHECK(bench::measure(
            device, "works", [] {}, true)
            .launches == 0);
}

TEST_CASE("bench: the kernels behind the limits compute what they say") {
  for (const std::string name : {"cpu", "gpu"}) {
    CAPTURE(name);
    Device device = device_of_class(name);
    const std::size_t bytes = 3 * bench::granule_bytes(device), items = 128;
    const Buffer a = counting(device, bytes, 0), b = counting(device, bytes, 17), y = device.allocate(bytes);
    run(device, bench::triad(device, a, b, y, 3));
    const std::vector<float> x = floats_in(device, a), z = floats_in(device, b);
    std::vector<float> wanted(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) wanted[i] = x[i] + 3 * z[i];
    CHECK(floats_in(device, y) == wanted);

    const Buffer partial = device.allocate(bench::partial_bytes(device, a));
    run(device, bench::read_sum(device, a, partial));
    const std::vector<float> sums = floats_in(device, partial);
    CHECK(std::accumulate(sums.begin(), sums.end(), 0.0) == std::accumulate(x.begin(), x.end(), 0.0));

    const Buffer chains = device.allocate(items * (name == "gpu" ? 4 : 16) * sizeof(float));
    run(device, bench::fma_chains(device, chains, items, 0.75, 0.5, 3));
    double sum = 0;
    for (std::size_t c = 0; c < bench::fma_chain_count; ++c)
      sum += std::pow(0.75, 3) / static_cast<double>(c + 1) + 0.5 * (1 + 0.75 + 0.75 * 0.75);
    for (const float value : floats_in(device, chains)) REQUIRE(value == doctest::Approx(sum).epsilon(1e-6));

    const Buffer one = device.allocate(sizeof(float));
    run(device, bench::touch(device, one));
    CHECK(floats_in(device, one) == std::vector<float>{1});
  }
}

TEST_CASE("bench: the products behind the limit of matrix units") {
  const ScopedVariable imitated("VIVANT_MATRIX_UNITS", "imitated");
  Device device(DeviceOptions{"", "cpu", false, "bf16x3"});
  const Buffer y = device.allocate(2 * sizeof(float));
  run(device, bench::matrix_products(device, y, 2, 3));
  CHECK(floats_in(device, y) == std::vector<float>{3 * 128, 3 * 128});
}

TEST_CASE("bench: the limits are within reason, and the roofline is the smaller of two") {
  for (const std::string name : {"cpu", "gpu"}) {
    CAPTURE(name);
    Device device = device_of_class(name);
    const bench::Limits limits = bench::measure_limits(device, true);
    CAPTURE(describe(limits));
    CHECK(limits.flops > 1e9);
    CHECK(limits.flops < 1e15);
    CHECK(limits.read_bandwidth > 1e8);
    CHECK(limits.triad_bandwidth > 1e8);
    CHECK(limits.bandwidth() < 1e14);
    CHECK(limits.launch_seconds > 1e-8);
    CHECK(limits.launch_seconds < 1e-2);
    CHECK(limits.launch_and_finish_seconds > limits.launch_seconds);
  }
  const bench::Limits limits{.flops = 100, .read_bandwidth = 5, .triad_bandwidth = 10};
  CHECK(limits.least_seconds(300, 20) == 3);  // arithmetic
  CHECK(limits.least_seconds(100, 20) == 2);  // memory, by the faster of its two limits
  const bench::Pass pass{.seconds = 4, .flops = 100, .bytes = 20};
  CHECK(pass.percent_of_peak(limits) == 50);
}

TEST_CASE("bench: labels keep off each other and off what is blocked") {
  const bench::Box frame{0, 0, 200, 200}, wall{90, 0, 10, 200};
  bench::LabelPlacer placer(frame);
  placer.block(wall);
  std::vector<bench::Box> labels = {wall};
  for (int i = 0; i < 40; ++i) labels.push_back(placer.place(80 + i % 5, 100 + i % 3, 13, 9));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    CHECK(labels[i].inside(frame));
    for (std::size_t k = 0; k < i; ++k) CHECK_FALSE(labels[i].overlaps(labels[k]));
  }
}

TEST_CASE("bench: the roofline picture is well-formed and shows every pass") {
  std::vector<bench::OpTiming> timings;
  for (const cases::OpCase* op_case : bench::cases_named(""))
    timings.push_back({op_case, {1e-3, 1e7, 1e6, 1, 0}, {2e-3, 1e7, 2e6, 1, 0}});
  timings.front().forward.flops = 0;  // in the panel of moves
  timings.back().both = {};
  const bench::Limits limits{5e10, 2e10, 1.5e10, 1e-6, 1e-5};
  const std::string svg = bench::roofline_svg(timings, limits, "A <fast> & new device");
  const TemporaryFolder folder;
  write_file(folder / "roofline.svg", svg);
  CHECK(is_xml(folder / "roofline.svg"));
  const auto count = [&](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = svg.find(part); at != std::string::npos; at = svg.find(part, at + 1)) ++found;
    return found;
  };
  CHECK(count("<circle ") == timings.size() + 1);  // and one in the legend
  CHECK(count("<path ") == timings.size());
  for (const bench::OpTiming& timing : timings) CHECK(contains(svg, ">" + timing.op_case->op + "<"));
  for (const char* part :
       {"A &lt;fast> &amp; new", "fp32 FMA: 50.0 GF/s", "read: 20.0 GB/s", "triad: 15.0 GB/s"})
    CHECK(contains(svg, part));
}

TEST_CASE("bench: one JSON object for every op, nothing is allocated in a run") {
  const Finished finished = run_vivant("bench reduction --quick --json");
  REQUIRE(finished.exit_code == 0);
  std::istringstream lines(finished.out);
  std::string line;
  std::vector<std::string> ops;
  while (std::getline(lines, line)) {
    const auto row = nlohmann::json::parse(line);
    CAPTURE(line);
    ops.push_back(row.at("op"));
    CHECK(row.at("sizes").size() == 3);
    CHECK(row.at("attributes").is_object());
    CHECK(row.at("device").get<std::string>() != "");
    CHECK(contains("cpu gpu", row.at("device_class")));
    for (const std::string pass : {"forward", "forward_and_backward"}) {
      for (const char* key : {"_seconds", "_gflops", "_gigabytes_per_second", "_percent_of_peak"})
        CHECK(row.at(pass + key).get<double>() > 0);
      CHECK(row.at(pass + "_launches").get<double>() >= 1);
      CHECK(row.at(pass + "_allocations").get<double>() == 0);
    }
    CHECK(row["forward_and_backward_launches"].get<double>() > row["forward_launches"].get<double>());
  }
  CHECK(ops == std::vector<std::string>{"mean", "sum", "sum_channels", "sum_groups", "sum_rows"});
}

TEST_CASE("bench: a table, and a roofline with its figures") {
  const Finished table = run_vivant("bench ray_generation --quick --device-class gpu");
  CAPTURE(table.err);
  REQUIRE(table.exit_code == 0);
  for (const char* part : {"fp32 FMA", "matrix units: none", "% peak", "ray_generation 16x65536", "forward"})
    CHECK(contains(table.out, part));
  const TemporaryFolder folder;
  const std::string svg = (folder / "x.svg").string(), json = (folder / "x.json").string();
  const Finished roofline = run_vivant("bench roofline body_skinning --quick -o " + svg + " --json " + json);
  CAPTURE(roofline.err);
  REQUIRE(roofline.exit_code == 0);
  CHECK(is_xml(svg));
  CHECK(contains(read_whole_file(svg), ">body_skinning<"));
  const auto figures = nlohmann::json::parse(read_whole_file(json));
  CHECK(figures["limits"]["fma_gflops"].get<double>() > 1);
  CHECK(figures["limits"]["matrix_units"].is_string());
  CHECK(contains(figures["rows"].dump(), "\"body_skinning\""));
}

TEST_CASE("bench: wrong names and places are one line") {
  check_error("bench no_such_op", 2, "'no_such_op'");
  check_error("bench roofline no_such_op", 2, "'no_such_op'");
  check_error("bench roofline body_skinning --quick -o /no/such/folder/x.svg", 1, "/no/such/folder");
  const TemporaryFolder folder;
  check_error("bench roofline body_skinning --quick --json /no/such/x.json -o " + (folder / "x.svg").string(),
              1, "/no/such");
  CHECK(std::filesystem::is_empty(folder.path()));
}
