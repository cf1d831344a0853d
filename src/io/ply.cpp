#include "vivant/io/ply.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace {

struct Property {
  std::string name, type, count_type;  // count_type is empty unless the property is a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::size_t size = 0;
};

/// Bytes, signedness and kind of a PLY type under its two names.
struct PlyType {
  const char *name, *alias;
  std::size_t size;
};
constexpr PlyType ply_types[] = {{"char", "int8", 1},     {"uchar", "uint8", 1},   {"short", "int16", 2},
                                 {"ushort", "uint16", 2}, {"int", "int32", 4},     {"uint", "uint32", 4},
                                 {"float", "float32", 4}, {"double", "float64", 8}};

const PlyType& type_named(const std::string& name) {
  for (const PlyType& type : ply_types) {
    if (name == type.name || name == type.alias) return type;
  }
  fail("unknown property type '{}'", name);
}

Header parse_header(std::string_view data) {
  if (!data.starts_with("ply")) fail("not a PLY file");
  Header header;
  std::size_t at = 0;
  for (std::string line, word; word != "end_header";) {
    const std::size_t end = data.find('\n', at);
    if (end == std::string_view::npos) fail("its header has no end");
    std::istringstream words{std::string(data.substr(at, end - at))};
    at = end + 1;
    word.clear();
    words >> word;
    if (word == "format") {
      words >> header.format;
    } else if (word == "element") {
      Element element;
      if (!(words >> element.name >> element.count)) fail("a broken 'element' line in its header");
      header.elements.push_back(element);
    } else if (word == "property") {
      Property property;
      words >> property.type;
      if (property.type == "list") words >> property.count_type >> property.type;
      if (!(words >> property.name) || header.elements.empty())
        fail("a broken 'property' line in its header");
      type_named(property.type);
      if (!property.count_type.empty()) type_named(property.count_type);
      header.elements.back().properties.push_back(property);
    }
  }
  header.size = at;
  if (header.format != "ascii" && header.format != "binary_little_endian" &&
      header.format != "binary_big_endian") {
    fail("format '{}' is not supported", header.format);
  }
  return header;
}

/// Reads one number after the other, from text or bytes.
class NumberReader {
 public:
  NumberReader(std::string_view data, const std::string& format)
      : data_(data), ascii_(format == "ascii"), swap_(format == "binary_big_endian") {}

  double next(const std::string& type_name) {
    if (ascii_) return next_text();
    const PlyType& type = type_named(type_name);
    if (data_.size() < type.size) fail("the file is cut short");
    char bytes[8];
    std::memcpy(bytes, data_.data(), type.size);
    if (swap_) std::reverse(bytes, bytes + type.size);
    data_.remove_prefix(type.size);
    switch (&type - ply_types) {
      case 0:
        return as<std::int8_t>(bytes);
      case 1:
        return as<std::uint8_t>(bytes);
      case 2:
        return as<std::int16_t>(bytes);
      case 3:
        return as<std::uint16_t>(bytes);
      case 4:
        return as<std::int32_t>(bytes);
      case 5:
        return as<std::uint32_t>(bytes);
      case 6:
        return as<float>(bytes);
      default:
        return as<double>(bytes);
    }
  }

  std::size_t bytes_left() const { return data_.size(); }

 private:
  template <typename T>
  static double as(const char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return static_cast<double>(value);
  }

  double next_text() {
    const std::size_t start = std::min(data_.find_first_not_of(" \t\r\n"), data_.size());
    data_.remove_prefix(start);
    const std::size_t length = std::min(data_.find_first_of(" \t\r\n"), data_.size());
    if (length == 0) fail("the file is cut short");
    const std::string word(data_.substr(0, length));
    data_.remove_prefix(length);
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != '\0') fail("'{}' is not a number", word);
    return value;
  }

  std::string_view data_;
  bool ascii_, swap_;
};

std::uint8_t colour_from(double value, const std::string& type) {
  if (type_named(type).size >= 4 && (type.starts_with("float") || type.starts_with("double"))) value *= 255;
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0l, 255l));
}

PointCloud parse(std::string_view data) {
  const Header header = parse_header(data);
  NumberReader numbers(data.substr(header.size), header.format);
  PointCloud cloud;
  for (const Element& element : header.elements) {
    const bool vertices = element.name == "vertex";
    const auto column = [&](const char* name) {
      const auto found =
          std::find_if(element.properties.begin(), element.properties.end(),
                       [&](const Property& p) { return p.name == name && p.count_type.empty(); });
      return found == element.properties.end() ? -1 : static_cast<int>(found - element.properties.begin());
    };
    const int position[3] = {column("x"), column("y"), column("z")};
    const int colour[3] = {column("red"), column("green"), column("blue")};
    const bool coloured = std::min({colour[0], colour[1], colour[2]}) >= 0;
    if (vertices && std::min({position[0], position[1], position[2]}) < 0)
      fail("its vertices have no x, y and z");
    if (element.count > 0 && element.properties.empty())
      fail("its element '{}' has no properties", element.name);
    // Every number takes at least a byte: a larger count is broken, not worth the memory.
    if (element.count > numbers.bytes_left()) fail("the file is cut short");
    std::vector<double> row(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t p = 0; p < row.size(); ++p) {
        const Property& property = element.properties[p];
        const double count = property.count_type.empty() ? 1 : numbers.next(property.count_type);
        for (double k = 0; k < count; ++k) row[p] = numbers.next(property.type);
      }
      if (!vertices) continue;
      const Eigen::Vector3d point(row[position[0]], row[position[1]], row[position[2]]);
      if (!point.allFinite()) fail("vertex {} is not finite", i);
      cloud.positions.push_back(point.cast<float>());
      if (!coloured) continue;
      std::array<std::uint8_t, 3> rgb;
      for (int c = 0; c < 3; ++c) rgb[c] = colour_from(row[colour[c]], element.properties[colour[c]].type);
      cloud.colours.push_back(rgb);
    }
    if (vertices) return cloud;
  }
  fail("it has no vertices");
}

}  // namespace

PointCloud read_ply(const std::filesystem::path& path) {
  const std::string data = read_whole_file(path);
  try {
    return parse(data);
  } catch (const Error& error) {
    fail("{}: {}", path.string(), error.what());
  }
}

void write_ply(const std::filesystem::path& path, const PointCloud& cloud) {
  const bool coloured = !cloud.colours.empty();
  if (coloured && cloud.colours.size() != cloud.positions.size()) {
    fail("'{}': {} colours for {} points", path.string(), cloud.colours.size(), cloud.positions.size());
  }
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n{}end_header\n",
      cloud.positions.size(),
      coloured ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "");
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
    out.append(reinterpret_cast<const char*>(cloud.positions[i].data()), 3 * sizeof(float));
    if (coloured) out.append(reinterpret_cast<const char*>(cloud.colours[i].data()), 3);
  }
  write_text_file(path, out);
}

}  // namespace vivant
