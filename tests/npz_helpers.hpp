#pragma once
#include <fmt/format.h>
#include <zlib.h>

#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace vivant {

/// The bytes of a .npy file: `type` such as "<f4", `shape` such as "(2, 3)".
inline std::string npy_bytes(const std::string& type, const std::string& shape, const std::string& data,
                             bool fortran = false) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type,
                                   fortran ? "True" : "False", shape);
  header.resize((header.size() + 10 + 1 + 63) / 64 * 64 - 11, ' ');
  header += '\n';
  const auto size = static_cast<std::uint16_t>(header.size());
  return std::string("\x93NUMPY\x01\x00", 8) + std::string(reinterpret_cast<const char*>(&size), 2) + header +
         data;
}

template <typename T>
std::string npy_bytes(const std::string& type, const std::string& shape, const std::vector<T>& values,
                      bool fortran = false) {
  return npy_bytes(type, shape,
                   std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)),
                   fortran);
}

/// The bytes of a zip archive of named entries, stored or deflated.
inline std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& entries, bool deflated) {
  const auto field = [](std::string& out, std::uint32_t value, int size) {
    for (int i = 0; i < size; ++i) out += static_cast<char>(value >> (8 * i));
  };
  std::string out, directory;
  for (const auto& [name, data] : entries) {
    std::string packed = data;
    if (deflated) {
      packed.resize(data.size() + data.size() / 100 + 100);
      z_stream stream{};
      deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
      stream.avail_in = static_cast<uInt>(data.size());
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = static_cast<uInt>(packed.size());
      deflate(&stream, Z_FINISH);
      packed.resize(stream.total_out);
      deflateEnd(&stream);
    }
    std::string common;
    field(common, 20, 2);                // version
    field(common, 0, 2);                 // flags
    field(common, deflated ? 8 : 0, 2);  // method
    field(common, 0, 4);                 // time
    field(common,
          static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size())),
          4);
    field(common, static_cast<std::uint32_t>(packed.size()), 4);
    field(common, static_cast<std::uint32_t>(data.size()), 4);
    field(common, static_cast<std::uint32_t>(name.size()), 2);
    field(common, 0, 2);  // extra
    directory += "PK\x01\x02";
    field(directory, 20, 2);
    directory += common;
    field(directory, 0, 2);  // comment
    field(directory, 0, 4);  // disk, internal attributes
    field(directory, 0, 4);  // external attributes
    field(directory, static_cast<std::uint32_t>(out.size()), 4);
    directory += name;
    out.append("PK\x03\x04").append(common).append(name).append(packed);
  }
  const std::size_t start = out.size();
  out += directory + "PK\x05\x06";
  field(out, 0, 4);
  field(out, static_cast<std::uint32_t>(entries.size()), 2);
  field(out, static_cast<std::uint32_t>(entries.size()), 2);
  field(out, static_cast<std::uint32_t>(directory.size()), 4);
  field(out, static_cast<std::uint32_t>(start), 4);
  field(out, 0, 2);
  return out;
}

}  // namespace vivant
