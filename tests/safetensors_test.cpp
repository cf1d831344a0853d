#include "vivant/io/safetensors.hpp"

#include <cmath>
#include <limits>

#include "io_helpers.hpp"
#include "vivant/io/atomic_file.hpp"

using namespace vivant;

namespace {

/// A safetensors file with this header text and `data_size` bytes of data.
std::string file_with(const std::string& header, std::size_t data_size) {
  const std::uint64_t size = header.size();
  return std::string(reinterpret_cast<const char*>(&size), 8) + header + std::string(data_size, '\1');
}

std::string read_error(const TemporaryFolder& folder, const std::string& bytes) {
  write_file(folder / "broken.safetensors", bytes);
  return error_of([&] { read_safetensors(folder / "broken.safetensors"); });
}

}  // namespace

TEST_CASE("safetensors: every element type survives a round trip") {
  const TemporaryFolder folder;
  TensorFile file;
  file.metadata = {{"step", "12"}, {"note", "quotes \" and ümlauts"}};
  for (int i = 0; i <= static_cast<int>(ElementType::boolean); ++i) {
    HostTensor tensor(static_cast<ElementType>(i), {3, 5});
    for (std::size_t b = 0; b < tensor.bytes.size(); ++b) tensor.bytes[b] = static_cast<std::byte>(b * 7 + i);
    file.tensors.emplace("tensor " + std::string(element_name(tensor.type)), tensor);
  }
  file.tensors.emplace("scalar", HostTensor(ElementType::f32, {}));
  file.tensors.emplace("empty", HostTensor(ElementType::f32, {4, 0}));
  write_safetensors(folder / "a.safetensors", file);
  const TensorFile read = read_safetensors(folder / "a.safetensors");
  CHECK(read.metadata == file.metadata);
  REQUIRE(read.tensors.size() == file.tensors.size());
  for (const auto& [name, tensor] : file.tensors) {
    CAPTURE(name);
    CHECK(read.at(name).type == tensor.type);
    CHECK(read.at(name).shape == tensor.shape);
    CHECK(read.at(name).bytes == tensor.bytes);
  }
  // The same content gives the same bytes, and no temporary file stays behind.
  write_safetensors(folder / "b.safetensors", read);
  CHECK(read_whole_file(folder / "a.safetensors") == read_whole_file(folder / "b.safetensors"));
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 2);
}

TEST_CASE("safetensors: values are converted exactly") {
  const std::vector<float> values = {1.5f, -2.25f, 0, 65504};
  CHECK(HostTensor({2, 2}, std::span<const float>(values)).as_floats() == values);
  CHECK(half_to_float(0x3c00) == 1.0f);
  CHECK(half_to_float(0xc100) == -2.5f);
  CHECK(half_to_float(0x7bff) == 65504.0f);
  CHECK(half_to_float(0x0001) == std::ldexp(1.0f, -24));
  CHECK(std::isinf(half_to_float(0xfc00)));
  CHECK(std::isnan(half_to_float(0x7e00)));
  CHECK(bfloat16_to_float(0xc020) == -2.5f);
  HostTensor half(ElementType::f16, {1});
  half.bytes = {std::byte{0x00}, std::byte{0xc1}};
  CHECK(half.as_doubles() == std::vector<double>{-2.5});
  const std::vector<std::int64_t> integers = {-1, 5000000000};
  CHECK(HostTensor({2}, std::span<const std::int64_t>(integers)).as_ints() == integers);
  CHECK(contains(error_of([&] {
                   HostTensor({2, 2}, std::span<const float>(values)).as_ints();
                 }),
                 "F32 [2, 2]"));
  CHECK(contains(error_of([&] { HostTensor({3}, std::span<const float>(values)); }), "4 values"));
}

TEST_CASE("safetensors: lookups name the file, the tensor and the shape") {
  const TemporaryFolder folder;
  TensorFile file;
  const std::vector<float> values = {1, std::numeric_limits<float>::quiet_NaN(), 3, 4, 5, 6};
  file.tensors.emplace("weight", HostTensor({2, 3}, std::span<const float>(values)));
  write_safetensors(folder / "a.safetensors", file);
  const TensorFile read = read_safetensors(folder / "a.safetensors");
  CHECK(read.at("weight", {-1, 3}).shape[0] == 2);
  CHECK(contains(error_of([&] { read.at("bias"); }), "a.safetensors: no tensor 'bias' (it has: weight)"));
  CHECK(contains(error_of([&] { read.at("weight", {-1, 4}); }), "F32 [2, 3], its shape must be [any, 4]"));
  CHECK(contains(error_of([&] { read.finite_doubles("weight", {2, 3}); }), "holds nan at element 1"));
}

TEST_CASE("safetensors: malformed files give one clear line") {
  const TemporaryFolder folder;
  const std::string good = R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})";
  const struct {
    std::string bytes, message;
  } cases[] = {
      {"", "too few"},
      {"abc", "too few"},
      {file_with(good, 8).substr(0, 30), "cut short"},
      {std::string(8, '\xff') + good, "not a safetensors file"},
      {file_with(good, 4), "cut short"},
      {file_with(good, 9), "1 bytes after the last tensor"},
      {file_with(R"({"a":)", 0), "broken JSON"},
      {file_with("[1]", 0), "must be a JSON object"},
      {file_with(R"({"a":3})", 0), "tensor 'a'"},
      {file_with(R"({"a":{"dtype":"F32","shape":[2]}})", 8), "'data_offsets' is missing"},
      {file_with(R"({"a":{"dtype":"F33","shape":[2],"data_offsets":[0,8]}})", 8), "'F33' is not supported"},
      {file_with(R"({"a":{"dtype":7,"shape":[2],"data_offsets":[0,8]}})", 8), "'dtype' must be"},
      {file_with(R"({"a":{"dtype":"F32","shape":[3],"data_offsets":[0,8]}})", 8), "need 12"},
      {file_with(R"({"a":{"dtype":"F32","shape":[-2],"data_offsets":[0,8]}})", 8), "whole numbers"},
      {file_with(R"({"a":{"dtype":"F32","shape":[2.5],"data_offsets":[0,8]}})", 8), "whole numbers"},
      {file_with(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[8,0]}})", 8), "data_offsets [8, 0]"},
      {file_with(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0]}})", 8), "two numbers"},
      {file_with(R"({"a":{"dtype":"U8","shape":[4294967296,4294967296],"data_offsets":[0,8]}})", 8),
       "too large"},
      {file_with(R"({"a":{"dtype":"U8","shape":[9223372036854775807],"data_offsets":[0,8]}})", 8),
       "too large"},
      {file_with(R"({"a":{"dtype":"U8","shape":[4],"data_offsets":[0,4]},"b":{"dtype":"U8","shape":[4],)"
                 R"("data_offsets":[2,6]}})",
                 6),
       "overlap"},
      {file_with(R"({"a":{"dtype":"U8","shape":[4],"data_offsets":[4,8]}})", 8), "4 unused bytes"},
      {file_with(R"({"__metadata__":{"step":3}})", 0), "'step' is not"},
      {file_with(R"({"__metadata__":[]})", 0), "object of strings"},
  };
  for (const auto& [bytes, message] : cases) {
    const std::string error = read_error(folder, bytes);
    CAPTURE(error);
    CHECK(contains(error, "broken.safetensors: "));
    CHECK(contains(error, message));
  }
  CHECK(read_error(folder, file_with(good, 8)).empty());
  CHECK(contains(error_of([&] { read_safetensors(folder / "none.safetensors"); }), "does not exist"));
  CHECK(contains(error_of([&] { read_safetensors(folder.path()); }), "not a file"));
}

TEST_CASE("safetensors: a failed write leaves the old file") {
  const TemporaryFolder folder;
  write_file(folder / "a.safetensors", "old");
  TensorFile file;
  file.tensors.emplace("broken", HostTensor(ElementType::f32, {2}));
  file.tensors.at("broken").bytes.resize(3);
  CHECK(contains(error_of([&] { write_safetensors(folder / "a.safetensors", file); }), "'broken'"));
  CHECK(read_whole_file(folder / "a.safetensors") == "old");
  CHECK(contains(error_of([&] { write_safetensors(folder / "none/a.safetensors", TensorFile{}); }),
                 "cannot write"));
  {
    AtomicFile unfinished(folder / "a.safetensors");
    unfinished.write("half");
  }
  CHECK(read_whole_file(folder / "a.safetensors") == "old");
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}
