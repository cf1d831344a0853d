#include "jobs/config_table.hpp"

#include <algorithm>

#include "jobs/spelling.hpp"

namespace vivant {
namespace {

std::vector<ConfigSection> make_sections() {
  std::vector<ConfigSection> sections;
// clang-format off
#define SECTION(Type, name, help) { sections.push_back({#name, help, {}}); constexpr auto section = &Config::name;
#define KEY(key, lowest, highest, choices, help) sections.back().keys.push_back( \
    {sections.back().name + "." #key, [](Config& c) -> Setting { return &(c.*section).key; }, lowest, highest, choices, help});
#define INTEGER(name, standard, lowest, highest, help) KEY(name, lowest, highest, "", help)
#define REAL(name, standard, lowest, highest, help) KEY(name, lowest, highest, "", help)
#define FLAG(name, standard, help) KEY(name, 0, 1, "", help)
#define CHOICE(name, standard, choices, help) KEY(name, 0, 0, choices, help)
#define INTEGERS(name, standard, lowest, highest, help) KEY(name, lowest, highest, "", help)
#define LIST(...)
#define END(name) }
  // clang-format on
#include "vivant/jobs/config_keys.def"
#undef KEY
  return sections;
}

}  // namespace

const std::vector<ConfigSection>& config_sections() {
  static const std::vector<ConfigSection> sections = make_sections();
  return sections;
}

const ConfigKey* find_config_key(const std::string& name) {
  for (const ConfigSection& section : config_sections())
    for (const ConfigKey& key : section.keys)
      if (key.name == name) return &key;
  return nullptr;
}

std::string nearest_config_key(const std::string& name) {
  std::string nearest;
  std::size_t least = std::string::npos;
  for (const ConfigSection& section : config_sections())
    for (const ConfigKey& key : section.keys) {
      const std::string last_part = key.name.substr(section.name.size() + 1);
      const std::size_t distance =
          std::min(edit_distance(name, key.name), edit_distance(name, last_part) + 1);
      if (distance < least) {
        least = distance;
        nearest = key.name;
      }
    }
  return nearest;
}

}  // namespace vivant
