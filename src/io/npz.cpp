#include "vivant/io/npz.hpp"

#include <zlib.h>

#include <cstring>
#include <optional>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;

namespace {

/// Little-endian fields of a byte range, with bounds checks.
struct Bytes {
  std::string_view data;

  template <typename T>
  T read(std::size_t at) const {
    if (at > data.size() || data.size() - at < sizeof(T)) fail("cut short at byte {}", data.size());
    T value;
    std::memcpy(&value, data.data() + at, sizeof(T));
    return value;
  }
  std::string_view range(std::size_t at, std::uint64_t size) const {
    if (at > data.size() || data.size() - at < size) fail("cut short at byte {}", data.size());
    return data.substr(at, size);
  }
};

// ---- the .npy header: a Python dictionary such as {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4),
// }

/// The text after 'key': in the dictionary.
std::string_view after_key(std::string_view header, const char* key) {
  const std::size_t at = header.find(fmt::format("'{}'", key));
  const std::size_t colon = at == std::string_view::npos ? at : header.find(':', at);
  if (colon == std::string_view::npos) fail("its header has no '{}'", key);
  const std::size_t value = header.find_first_not_of(' ', colon + 1);
  if (value == std::string_view::npos) fail("its header has no value for '{}'", key);
  return header.substr(value);
}

/// The type of a description such as '<f4'; none for types that are not read (objects, strings, structures).
std::optional<ElementType> parse_type(std::string_view value) {
  if (value.empty() || value[0] != '\'') return std::nullopt;
  const std::string_view type = value.substr(1, value.find('\'', 1) - 1);
  if (type.size() != 3 || (type[0] == '>' && type[2] != '1')) return std::nullopt;
  const std::string_view kind = type.substr(1);
  static constexpr std::pair<std::string_view, ElementType> types[] = {
      {"f8", ElementType::f64}, {"f4", ElementType::f32}, {"f2", ElementType::f16},
      {"i8", ElementType::i64}, {"i4", ElementType::i32}, {"i2", ElementType::i16},
      {"i1", ElementType::i8},  {"u8", ElementType::u64}, {"u4", ElementType::u32},
      {"u2", ElementType::u16}, {"u1", ElementType::u8},  {"b1", ElementType::boolean}};
  for (const auto& [name, element] : types) {
    if (name == kind) return element;
  }
  return std::nullopt;
}

std::vector<std::int64_t> parse_shape(std::string_view value) {
  if (value.empty() || value[0] != '(') fail("its header's 'shape' is not a tuple");
  const std::size_t close = value.find(')');
  if (close == std::string_view::npos) fail("its header's 'shape' is not a tuple");
  std::vector<std::int64_t> shape;
  std::int64_t number = -1;
  for (char c : value.substr(1, close - 1)) {
    if (c >= '0' && c <= '9') {
      if (number > (std::int64_t{1} << 56)) fail("a size in its header's 'shape' is too large");
      number = std::max<std::int64_t>(number, 0) * 10 + (c - '0');
    } else if (c == ',' && number >= 0) {
      shape.push_back(number);
      number = -1;
    } else if (c != ' ' && c != 'L') {
      fail("its header's 'shape' is not a tuple of whole numbers");
    }
  }
  if (number >= 0) shape.push_back(number);
  return shape;
}

/// Fortran order to C order.
HostTensor transposed(const HostTensor& tensor) {
  HostTensor out(tensor.type, tensor.shape);
  const std::size_t size = element_size(tensor.type), rank = tensor.shape.size();
  std::vector<std::int64_t> index(rank, 0);
  std::vector<std::size_t> stride(rank, 1);
  for (std::size_t d = 1; d < rank; ++d)
    stride[d] = stride[d - 1] * static_cast<std::size_t>(tensor.shape[d - 1]);
  for (std::size_t to = 0; to < out.element_count(); ++to) {
    std::size_t from = 0;
    for (std::size_t d = 0; d < rank; ++d) from += stride[d] * static_cast<std::size_t>(index[d]);
    std::memcpy(out.bytes.data() + to * size, tensor.bytes.data() + from * size, size);
    for (std::size_t d = rank; d-- > 0;) {
      if (++index[d] < tensor.shape[d]) break;
      index[d] = 0;
    }
  }
  return out;
}

/// None for arrays of types that are not read.
std::optional<HostTensor> parse_npy(std::string_view data) {
  const Bytes bytes{data};
  if (bytes.range(0, 6) != "\x93NUMPY") fail("not a NumPy array");
  const int version = bytes.read<std::uint8_t>(6);
  if (version < 1 || version > 3) fail("NumPy format version {} is not supported", version);
  const std::size_t start = version == 1 ? 10 : 12;
  const std::size_t size = version == 1 ? bytes.read<std::uint16_t>(8) : bytes.read<std::uint32_t>(8);
  const std::string_view header = bytes.range(start, size);
  const std::optional<ElementType> type = parse_type(after_key(header, "descr"));
  if (!type) return std::nullopt;
  const bool fortran = after_key(header, "fortran_order").starts_with("True");
  const std::vector<std::int64_t> shape = parse_shape(after_key(header, "shape"));
  const std::uint64_t wanted = element_count(shape) * element_size(*type);
  const std::string_view values = bytes.range(start + size, wanted);
  HostTensor tensor(*type, shape);
  if (!values.empty()) std::memcpy(tensor.bytes.data(), values.data(), values.size());
  return fortran && shape.size() > 1 ? transposed(tensor) : tensor;
}

// ---- the zip archive

struct ZipEntry {
  std::string name;
  int method;  // 0 stored, 8 deflated
  std::uint32_t crc;
  std::uint64_t compressed_size, size, header_at;
};

/// Replaces sizes of 0xffffffff by those of the zip64 extra field.
void apply_zip64(ZipEntry& entry, Bytes extra) {
  std::size_t at = 0;
  while (at + 4 <= extra.data.size()) {
    const auto id = extra.read<std::uint16_t>(at), size = extra.read<std::uint16_t>(at + 2);
    if (id == 1) {
      std::size_t field = at + 4;
      for (std::uint64_t* value : {&entry.size, &entry.compressed_size, &entry.header_at}) {
        if (*value != 0xffffffffu) continue;
        *value = extra.read<std::uint64_t>(field);
        field += 8;
      }
    }
    at += 4 + std::size_t{size};
  }
}

std::vector<ZipEntry> read_directory(Bytes zip) {
  constexpr std::size_t end_size = 22;
  if (zip.data.size() < end_size) fail("not a zip archive, or cut short");
  const std::size_t end = zip.data.rfind("PK\x05\x06", zip.data.size() - end_size);
  if (end == std::string_view::npos) fail("not a zip archive, or cut short");
  std::uint64_t count = zip.read<std::uint16_t>(end + 10), at = zip.read<std::uint32_t>(end + 16);
  if (at == 0xffffffffu || count == 0xffff) {
    if (end < 20 || zip.range(end - 20, 4) != "PK\x06\x07") fail("its zip64 directory is missing");
    const auto end64 = zip.read<std::uint64_t>(end - 20 + 8);
    if (zip.range(end64, 4) != "PK\x06\x06") fail("its zip64 directory is missing");
    count = zip.read<std::uint64_t>(end64 + 32);
    at = zip.read<std::uint64_t>(end64 + 48);
  }
  std::vector<ZipEntry> entries;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (zip.range(at, 4) != std::string_view("PK\x01\x02")) fail("its zip directory is broken");
    const std::size_t name_size = zip.read<std::uint16_t>(at + 28),
                      extra_size = zip.read<std::uint16_t>(at + 30);
    ZipEntry entry{.name = std::string(zip.range(at + 46, name_size)),
                   .method = zip.read<std::uint16_t>(at + 10),
                   .crc = zip.read<std::uint32_t>(at + 16),
                   .compressed_size = zip.read<std::uint32_t>(at + 20),
                   .size = zip.read<std::uint32_t>(at + 24),
                   .header_at = zip.read<std::uint32_t>(at + 42)};
    apply_zip64(entry, Bytes{zip.range(at + 46 + name_size, extra_size)});
    at += 46 + name_size + extra_size + zip.read<std::uint16_t>(at + 32);
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::string inflate_entry(const ZipEntry& entry, std::string_view data) {
  // Deflate cannot expand more than about 1032 times: a larger claim is a broken size, not worth the memory.
  if (entry.size / 1100 > data.size()) fail("{} bytes cannot unpack to {}", data.size(), entry.size);
  std::string out(entry.size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) fail("zlib does not start");
  int state = Z_OK;
  std::size_t in_at = 0, out_at = 0;
  while (state == Z_OK) {
    constexpr std::size_t chunk = std::size_t{1} << 30;  // zlib counts in 32 bits
    const std::size_t in_now = std::min(chunk, data.size() - in_at),
                      out_now = std::min(chunk, out.size() - out_at);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data() + in_at));
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + out_at);
    stream.avail_in = static_cast<uInt>(in_now);
    stream.avail_out = static_cast<uInt>(out_now);
    state = inflate(&stream, Z_NO_FLUSH);
    in_at += in_now - stream.avail_in;
    out_at += out_now - stream.avail_out;
  }
  inflateEnd(&stream);
  if (state != Z_STREAM_END || out_at != out.size()) fail("its compressed data are broken");
  return out;
}

std::string unpack(Bytes zip, const ZipEntry& entry) {
  if (zip.range(entry.header_at, 4) != std::string_view("PK\x03\x04")) fail("its zip entry is broken");
  const std::size_t start = entry.header_at + 30 + zip.read<std::uint16_t>(entry.header_at + 26) +
                            zip.read<std::uint16_t>(entry.header_at + 28);
  const std::string_view data = zip.range(start, entry.compressed_size);
  if (entry.method != 0 && entry.method != 8) fail("zip method {} is not supported", entry.method);
  std::string out = entry.method == 0 ? std::string(data) : inflate_entry(entry, data);
  const uLong crc = crc32_z(0, reinterpret_cast<const Bytef*>(out.data()), out.size());
  if (out.size() != entry.size || crc != entry.crc) fail("its checksum does not agree (the file is damaged)");
  return out;
}

}  // namespace

TensorFile read_npz(const fs::path& path) {
  const std::string text = read_whole_file(path);
  TensorFile file;
  file.source = path.string();
  std::string entry_name;
  try {
    for (const ZipEntry& entry : read_directory(Bytes{text})) {
      entry_name = entry.name;
      if (!entry.name.ends_with(".npy")) continue;
      const std::string name = entry.name.substr(0, entry.name.size() - 4);
      if (std::optional<HostTensor> tensor = parse_npy(unpack(Bytes{text}, entry))) {
        file.tensors.emplace(name, std::move(*tensor));
      } else {
        std::string& skipped = file.metadata["skipped"];
        skipped += (skipped.empty() ? "" : ", ") + name;
      }
    }
  } catch (const Error& error) {
    fail("{}: {}{}{}", path.string(), entry_name, entry_name.empty() ? "" : ": ", error.what());
  }
  return file;
}

HostTensor read_npy(const fs::path& path) {
  const std::string text = read_whole_file(path);
  std::optional<HostTensor> tensor;
  try {
    tensor = parse_npy(text);
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
  if (!tensor) fail("{}: only arrays of numbers can be read", path.string());
  return std::move(*tensor);
}

}  // namespace vivant
