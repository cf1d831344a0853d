#include "vivant/io/ply.hpp"

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

TEST_CASE("ply: binary round trip with and without colours") {
  const TemporaryFolder folder;
  PointCloud cloud;
  for (int i = 0; i < 17; ++i) cloud.positions.emplace_back(0.1f * i, -i, 1e-3f * i * i);
  write_ply(folder / "a.ply", cloud);
  CHECK(read_ply(folder / "a.ply").positions == cloud.positions);
  CHECK(read_ply(folder / "a.ply").colours.empty());
  for (std::uint8_t i = 0; i < 17; ++i) cloud.colours.push_back({i, std::uint8_t(255 - i), 7});
  write_ply(folder / "b.ply", cloud);
  CHECK(read_ply(folder / "b.ply").positions == cloud.positions);
  CHECK(read_ply(folder / "b.ply").colours == cloud.colours);
  cloud.colours.pop_back();
  CHECK(contains(error_of([&] { write_ply(folder / "c.ply", cloud); }), "16 colours for 17 points"));
}

TEST_CASE("ply: ASCII, big-endian, lists, other elements and other properties") {
  const TemporaryFolder folder;
  write_file(
      folder / "a.ply",
      "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement camera 1\r\nproperty list uchar int id\r\n"
      "element vertex 2\r\nproperty double x\r\nproperty float nx\r\nproperty double y\r\nproperty double "
      "z\r\n"
      "property float red\r\nproperty float green\r\nproperty float blue\r\nelement face 1\r\n"
      "property list uchar int vertex_indices\r\nend_header\r\n2 8 9\r\n1 0 2 3 0 0.5 1\r\n-4 0 5e-1 6 1 1 "
      "1\r\n"
      "3 0 1 1\r\n");
  const PointCloud cloud = read_ply(folder / "a.ply");
  REQUIRE(cloud.positions.size() == 2);
  CHECK(cloud.positions[0] == Eigen::Vector3f(1, 2, 3));
  CHECK(cloud.positions[1] == Eigen::Vector3f(-4, 0.5f, 6));
  CHECK(cloud.colours[0] == std::array<std::uint8_t, 3>{0, 128, 255});
  const std::string floats("\x3f\x80\x00\x00\x40\x00\x00\x00\xc0\x40\x00\x00", 12);
  write_file(folder / "b.ply",
             "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n" +
                 floats);
  CHECK(read_ply(folder / "b.ply").positions[0] == Eigen::Vector3f(1, 2, -3));
}

TEST_CASE("ply: malformed files give one clear line") {
  const TemporaryFolder folder;
  const std::string header = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n";
  const struct {
    std::string text, message;
  } cases[] = {
      {"plain text", "not a PLY file"},
      {"", "not a PLY file"},
      {header, "its header has no end"},
      {header + "end_header\n1 2 3 4\n", "no x, y and z"},
      {header + "property float z\nend_header\n1 2 3\n4 5\n", "cut short"},
      {header + "property float z\nend_header\n1 2 3\n4 5 nan\n", "vertex 1 is not finite"},
      {header + "property float z\nend_header\n1 2 3\n4 5 six\n", "'six' is not a number"},
      {header + "property quad z\nend_header\n", "unknown property type 'quad'"},
      {"ply\nformat zip 1.0\nend_header\n", "format 'zip'"},
      {"ply\nformat ascii 1.0\nelement vertex\nend_header\n", "broken 'element'"},
      {"ply\nformat ascii 1.0\nend_header\n", "no vertices"},
      {"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999999\nproperty float x\nproperty "
       "float y\n"
       "property float z\nend_header\nabc",
       "cut short"},
  };
  for (const auto& [text, message] : cases) {
    write_file(folder / "bad.ply", text);
    const std::string error = error_of([&] { read_ply(folder / "bad.ply"); });
    CAPTURE(error);
    CHECK(contains(error, "bad.ply: "));
    CHECK(contains(error, message));
  }
}
