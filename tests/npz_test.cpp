#include "vivant/io/npz.hpp"

#include <Eigen/Core>

#include "io_helpers.hpp"
#include "npz_helpers.hpp"
#include "vivant/data/body.hpp"

using namespace vivant;

TEST_CASE("npz: every element type, stored and deflated, C and Fortran order") {
  const TemporaryFolder folder;
  for (bool deflated : {false, true}) {
    CAPTURE(deflated);
    const std::vector<std::pair<std::string, std::string>> entries = {
        {"floats.npy", npy_bytes<float>("<f4", "(2, 3)", {1, 2, 3, 4, 5, 6})},
        {"fortran.npy", npy_bytes<double>("<f8", "(2, 3)", {1, 4, 2, 5, 3, 6}, true)},
        {"cube.npy", npy_bytes<std::int32_t>("<i4", "(2, 1, 2)", {1, 3, 2, 4}, true)},
        {"long.npy", npy_bytes<std::int64_t>("<i8", "(1,)", {-5000000000})},
        {"byte.npy", npy_bytes<std::uint8_t>("|u1", "(3,)", {7, 0, 255})},
        {"flag.npy", npy_bytes<std::uint8_t>("|b1", "(2,)", {1, 0})},
        {"word.npy", npy_bytes<std::uint32_t>("<u4", "(2L,)", {1, 4294967295u})},
        {"half.npy", npy_bytes<std::uint16_t>("<f2", "()", {0x3e00})},
        {"none.npy", npy_bytes<float>("<f4", "(0, 3)", {})},
        {"object.npy", npy_bytes("|O", "(1,)", "\x80\x04pickle")},
        {"text.npy", npy_bytes("<U3", "(1,)", std::string(12, 'a'))},
        {"notes.txt", "not an array"}};
    write_file(folder / "a.npz", zip_bytes(entries, deflated));
    const TensorFile file = read_npz(folder / "a.npz");
    CHECK(file.at("floats", {2, 3}).as_floats() == std::vector<float>{1, 2, 3, 4, 5, 6});
    CHECK(file.at("fortran", {2, 3}).as_doubles() == std::vector<double>{1, 2, 3, 4, 5, 6});
    CHECK(file.at("cube", {2, 1, 2}).as_ints() == std::vector<std::int64_t>{1, 2, 3, 4});
    CHECK(file.at("long").as_ints() == std::vector<std::int64_t>{-5000000000});
    CHECK(file.at("byte").as_ints() == std::vector<std::int64_t>{7, 0, 255});
    CHECK(file.at("flag").as_ints() == std::vector<std::int64_t>{1, 0});
    CHECK(file.at("word").as_ints() == std::vector<std::int64_t>{1, 4294967295});
    CHECK(file.at("half", {}).as_floats() == std::vector<float>{1.5f});
    CHECK(file.at("none", {0, 3}).as_floats().empty());
    CHECK(file.tensors.size() == 9);
    CHECK(file.metadata.at("skipped") == "object, text");
  }
  write_file(folder / "a.npy", npy_bytes<float>("<f4", "(2,)", {1, 2}));
  CHECK(read_npy(folder / "a.npy").as_floats() == std::vector<float>{1, 2});
}

TEST_CASE("npz: malformed archives give one clear line") {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& bytes) {
    write_file(folder / "bad.npz", bytes);
    return error_of([&] { read_npz(folder / "bad.npz"); });
  };
  const std::string array = npy_bytes<float>("<f4", "(2, 3)", {1, 2, 3, 4, 5, 6});
  const std::string good = zip_bytes({{"a.npy", array}}, true);
  CHECK(error(good).empty());
  // Cut anywhere, the archive is an error and never a crash.
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK(contains(error(good.substr(0, size)), "bad.npz: "));
  // With any one byte changed it is read or refused; damage to the array itself is always noticed.
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x41);
    error(damaged);
  }
  std::string stored = zip_bytes({{"a.npy", array}}, false);
  stored[35 + array.size() - 3] ^= 1;
  CHECK(contains(error(stored), "a.npy: its checksum does not agree"));
  const auto npy_error = [&](const std::string& bytes) {
    return error(zip_bytes({{"a.npy", bytes}}, false));
  };
  CHECK(contains(npy_error("hello"), "a.npy: cut short"));
  CHECK(contains(npy_error("hello, this is a text"), "not a NumPy array"));
  CHECK(contains(npy_error(array.substr(0, array.size() - 1)), "cut short"));
  CHECK(contains(npy_error(npy_bytes("<f4", "(99999999999999999999, 8)", "")), "too large"));
  CHECK(contains(npy_error(npy_bytes("<f4", "(9999999999, 9999999999)", "")), "too large"));
  CHECK(contains(npy_error(npy_bytes("<f4", "(-1,)", "")), "whole numbers"));
  CHECK(contains(npy_error(npy_bytes("<f4", "3", "")), "not a tuple"));
  CHECK(contains(error_of([&] { read_npz(folder / "none.npz"); }), "does not exist"));
}

TEST_CASE("body: an SMPL archive keeps the four largest weights and regresses its joints") {
  const TemporaryFolder folder;
  // Two vertices, six joints in a chain; each joint's position is a blend of the vertices.
  const std::vector<double> vertices = {0, 0, 0, 0, 6, 0};
  std::vector<double> regressor;
  for (int j = 0; j < 6; ++j) regressor.insert(regressor.end(), {1 - j / 6.0, j / 6.0});
  const std::vector<double> weights = {0.4, 0.3, 0.1, 0.1, 0.06, 0.04, 0, 0, 0, 0, 0, 1};
  const std::vector<double> shape = {0, 0, 0, 0, 0, 0, 1, 0.5, 0, 0, 0, 0};  // [2 vertices, 3, 2 directions]
  std::vector<std::pair<std::string, std::string>> entries = {
      {"v_template.npy", npy_bytes("<f8", "(2, 3)", vertices)},
      {"f.npy", npy_bytes<std::uint32_t>("<u4", "(1, 3)", {0, 1, 0})},
      {"weights.npy", npy_bytes("<f8", "(2, 6)", weights)},
      {"J_regressor.npy", npy_bytes("<f8", "(6, 2)", regressor)},
      {"kintree_table.npy",
       npy_bytes<std::uint32_t>("<u4", "(2, 6)", {4294967295u, 0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 5})},
      {"shapedirs.npy", npy_bytes("<f8", "(2, 3, 2)", shape)},
      {"posedirs.npy", npy_bytes("|O", "(1,)", "x")}};
  write_file(folder / "smpl.npz", zip_bytes(entries, true));
  const Body body = load_body(folder / "smpl.npz");
  CHECK(body.parents == std::vector<int>{-1, 0, 1, 2, 3, 4});
  CHECK((body.joints[3] - Eigen::Vector3d(0, 3, 0)).norm() < 1e-12);
  CHECK(body.influences == 4);
  CHECK(body.skin_joints == std::vector<int>{0, 1, 2, 3, 5, 0, 1, 2});
  CHECK(body.skin_weights[0] == doctest::Approx(0.4 / 0.9));
  CHECK(body.skin_weights[4] == 1);
  CHECK(body.shape_dirs.size() == 2);
  CHECK(body.shape_dirs[0][1] == Eigen::Vector3d(1, 0, 0));
  CHECK(body.shape_dirs[1][1] == Eigen::Vector3d(0.5, 0, 0));
  CHECK((body.joint_dirs[0][3] - Eigen::Vector3d(0.5, 0, 0)).norm() < 1e-12);
  CHECK(body.joint_names[1] == "left_hip");
  CHECK(canonical_pose(body)[1].z() == 0.5);
  CHECK(canonical_pose(body)[2].z() == -0.5);
  entries[3].second = npy_bytes("|O", "(1,)", "sparse");
  write_file(folder / "smpl.npz", zip_bytes(entries, true));
  CHECK(contains(error_of([&] { load_body(folder / "smpl.npz"); }), "(J_regressor, posedirs)"));
}
