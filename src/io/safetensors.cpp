#include "vivant/io/safetensors.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr std::uint64_t largest_header = 100'000'000;

struct Entry {
  std::string name;
  ElementType type;
  std::vector<std::int64_t> shape;
  std::uint64_t begin, end;
};

std::optional<ElementType> element_type_named(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ElementType::boolean); ++i) {
    if (element_name(static_cast<ElementType>(i)) == name) return static_cast<ElementType>(i);
  }
  return std::nullopt;
}

std::vector<std::uint64_t> unsigned_list(const json& list, const char* key) {
  if (!list.is_array()) fail("'{}' must be a list of whole numbers", key);
  std::vector<std::uint64_t> values;
  for (const json& value : list) {
    if (!value.is_number_unsigned()) fail("'{}' must be a list of whole numbers", key);
    values.push_back(value.get<std::uint64_t>());
  }
  return values;
}

/// Checks one entry of the header; the caller adds the file's and the tensor's name to the message.
Entry parse_entry(const std::string& name, const json& value, std::uint64_t data_size) {
  if (!value.is_object()) fail("its description must be an object");
  for (const char* key : {"dtype", "shape", "data_offsets"}) {
    if (!value.contains(key)) fail("'{}' is missing", key);
  }
  if (!value["dtype"].is_string()) fail("'dtype' must be a string");
  const auto type = element_type_named(value["dtype"].get<std::string>());
  if (!type) fail("element type '{}' is not supported", value["dtype"].get<std::string>());
  Entry entry{.name = name, .type = *type, .shape = {}, .begin = 0, .end = 0};
  for (std::uint64_t size : unsigned_list(value["shape"], "shape")) {
    if (size > (1ull << 60)) fail("size {} in 'shape' is too large", size);
    entry.shape.push_back(static_cast<std::int64_t>(size));
  }
  const std::vector<std::uint64_t> offsets = unsigned_list(value["data_offsets"], "data_offsets");
  if (offsets.size() != 2) fail("'data_offsets' must hold two numbers");
  entry.begin = offsets[0];
  entry.end = offsets[1];
  if (entry.begin > entry.end || entry.end > data_size) {
    fail("data_offsets [{}, {}] leave the file's {} bytes of data (is the file cut short?)", entry.begin,
         entry.end, data_size);
  }
  const std::uint64_t size = element_count(entry.shape) * element_size(entry.type);
  if (size != entry.end - entry.begin) {
    fail("{} bytes of data, its shape and type need {}", entry.end - entry.begin, size);
  }
  return entry;
}

void read_metadata(const json& value, TensorFile& file) {
  if (!value.is_object()) fail("'__metadata__' must be an object of strings");
  for (const auto& [key, text] : value.items()) {
    if (!text.is_string()) fail("'__metadata__' must be an object of strings, '{}' is not", key);
    file.metadata[key] = text.get<std::string>();
  }
}

std::vector<Entry> parse_header(const std::string& text, std::uint64_t data_size, TensorFile& file) {
  json header;
  try {
    header = json::parse(text);
  } catch (const json::parse_error& error) {
    fail("its header is broken JSON at byte {}", 8 + error.byte);
  }
  if (!header.is_object()) fail("its header must be a JSON object");
  std::vector<Entry> entries;
  for (const auto& [name, value] : header.items()) {
    if (name == "__metadata__") {
      read_metadata(value, file);
      continue;
    }
    try {
      entries.push_back(parse_entry(name, value, data_size));
    } catch (const Error& error) {
      fail("tensor '{}': {}", name, error.what());
    }
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return std::tie(a.begin, a.end, a.name) < std::tie(b.begin, b.end, b.name);
  });
  std::uint64_t position = 0;
  for (const Entry& entry : entries) {
    if (entry.begin < position) fail("tensor '{}': its data overlap another tensor's", entry.name);
    if (entry.begin > position)
      fail("tensor '{}': {} unused bytes before its data", entry.name, entry.begin - position);
    position = entry.end;
  }
  if (position != data_size) fail("{} bytes after the last tensor", data_size - position);
  return entries;
}

TensorFile read_stream(std::ifstream& stream, std::uint64_t file_size) {
  std::uint64_t header_size = 0;
  if (file_size < sizeof(header_size)) fail("{} bytes are too few for a header", file_size);
  stream.read(reinterpret_cast<char*>(&header_size), sizeof(header_size));
  if (header_size > largest_header || header_size > file_size - sizeof(header_size)) {
    fail("a header of {} bytes in a file of {} (not a safetensors file, or cut short)", header_size,
         file_size);
  }
  std::string text(header_size, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(header_size));
  TensorFile file;
  const std::uint64_t data_size = file_size - sizeof(header_size) - header_size;
  for (const Entry& entry : parse_header(text, data_size, file)) {
    HostTensor tensor(entry.type, entry.shape);
    stream.read(reinterpret_cast<char*>(tensor.bytes.data()),
                static_cast<std::streamsize>(tensor.bytes.size()));
    file.tensors.emplace(entry.name, std::move(tensor));
  }
  if (!stream) fail("reading failed");
  return file;
}

}  // namespace

TensorFile read_safetensors(const fs::path& path) {
  if (!fs::exists(path)) fail("'{}' does not exist", path.string());
  if (!fs::is_regular_file(path)) fail("'{}' is not a file", path.string());
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail("cannot read '{}'", path.string());
  try {
    TensorFile file = read_stream(stream, fs::file_size(path));
    file.source = path.string();
    return file;
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
}

void write_safetensors(const fs::path& path, const TensorFile& file) {
  std::vector<const std::pair<const std::string, HostTensor>*> order;
  for (const auto& item : file.tensors) {
    const HostTensor& tensor = item.second;
    if (element_count(tensor.shape) * element_size(tensor.type) != tensor.bytes.size()) {
      fail("{}: tensor '{}' is {} but has {} bytes", path.string(), item.first, tensor.describe(),
           tensor.bytes.size());
    }
    order.push_back(&item);
  }
  // Wide elements first: every tensor is then aligned to its element.
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return element_size(a->second.type) > element_size(b->second.type);
  });
  json header = json::object();
  if (!file.metadata.empty()) header["__metadata__"] = file.metadata;
  std::uint64_t position = 0;
  for (const auto* item : order) {
    const std::uint64_t end = position + item->second.bytes.size();
    header[item->first] = {{"dtype", element_name(item->second.type)},
                           {"shape", item->second.shape},
                           {"data_offsets", {position, end}}};
    position = end;
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  const std::uint64_t header_size = text.size();
  AtomicFile out(path);
  out.write(&header_size, sizeof(header_size));
  out.write(text);
  for (const auto* item : order) out.write(item->second.bytes.data(), item->second.bytes.size());
  out.commit();
}

}  // namespace vivant
