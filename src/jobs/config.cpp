#include "vivant/jobs/config.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "jobs/config_table.hpp"
#include "jobs/toml_text.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

struct Preset {
  std::string name;
  std::vector<std::string> settings;  ///< what differs from the standard values
};

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"demo",
       {"scene.plane_channels=16", "scene.variation_weight=0.01", "scene.distortion_weight=0.002",
        "scene.unet_widths=[32, 64, 128]", "scene.rays=2048", "scene.steps=3000", "human.plane_size=128",
        "human.plane_scales=3", "human.unet_widths=[32, 64, 128]", "human.samples=64", "human.error_layers=2",
        "human.error_width=64", "human.steps=1000", "features.steps=150", "features.patch=128",
        "features.views=24", "style.steps=120", "style.crop=128", "style.novel_views=8"}},
      {"standard", {}},
      {"quality",
       {"scene.plane_size=512", "scene.plane_scales=5", "scene.variation_weight=0.15", "scene.steps=14000"}},
  };
  return all;
}

template <typename... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) {
  throw UsageError(fmt::format(format, std::forward<Args>(args)...));
}

/// What a key takes, for messages: "a whole number from 16 to 2048".
std::string expected(const ConfigKey& key, const Setting& setting) {
  if (std::holds_alternative<bool*>(setting)) return "true or false";
  if (std::holds_alternative<std::string*>(setting)) {
    std::string list = key.choices;
    std::replace(list.begin(), list.end(), '|', ' ');
    return "one of: " + list;
  }
  const char* what = std::holds_alternative<double*>(setting)         ? "a number"
                     : std::holds_alternative<std::int64_t*>(setting) ? "a whole number"
                                                                      : "a list of whole numbers";
  return fmt::format("{} from {} to {}", what, key.lowest, key.highest);
}

bool in_range(const ConfigKey& key, double number) { return number >= key.lowest && number <= key.highest; }

bool assign(const ConfigKey& key, std::int64_t& target, const toml::node& node) {
  if (!node.is_integer()) return false;
  target = **node.as_integer();
  return in_range(key, static_cast<double>(target));
}
bool assign(const ConfigKey& key, double& target, const toml::node& node) {
  if (!node.is_number()) return false;
  target = *node.value<double>();
  return in_range(key, target);  // false for NaN
}
bool assign(const ConfigKey&, bool& target, const toml::node& node) {
  if (!node.is_boolean()) return false;
  target = **node.as_boolean();
  return true;
}
bool assign(const ConfigKey& key, std::string& target, const toml::node& node) {
  if (!node.is_string()) return false;
  target = **node.as_string();
  return !target.empty() && target.find('|') == std::string::npos &&
         ("|" + key.choices + "|").find("|" + target + "|") != std::string::npos;
}
bool assign(const ConfigKey& key, std::vector<std::int64_t>& target, const toml::node& node) {
  if (!node.is_array() || node.as_array()->empty()) return false;
  target.clear();
  for (const toml::node& element : *node.as_array())
    if (!assign(key, target.emplace_back(), element)) return false;
  return true;
}

/// `where` opens the message: "run.toml line 3" or "--set".
void set_key(Config& config, const std::string& name, const toml::node& node, const std::string& where) {
  const ConfigKey* key = find_config_key(name);
  if (!key) refuse("{}: unknown key '{}': did you mean '{}'?", where, name, nearest_config_key(name));
  const Setting setting = key->setting(config);
  if (!std::visit([&](auto* target) { return assign(*key, *target, node); }, setting))
    refuse("{}: {} must be {}, not {}", where, name, expected(*key, setting), text_of(node));
}

void apply_setting(Config& config, const std::string& setting, const std::string& where) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos) refuse("{} takes key=value, not '{}'", where, setting);
  const std::string name = setting.substr(0, equals), value = setting.substr(equals + 1);
  const ConfigKey* key = find_config_key(name);
  const bool is_text = key && std::holds_alternative<std::string*>(key->setting(config));
  toml::table table;
  if (!is_text) {
    try {
      table = toml::parse("value = " + value);
    } catch (const toml::parse_error&) {  // what is no TOML value is refused as a text below
    }
  }
  if (!table.contains("value")) table.insert_or_assign("value", value);
  set_key(config, name, *table.get("value"), where);
}

void apply_table(Config& config, const toml::table& table, const std::string& source) {
  for (const auto& [section, content] : table) {
    const std::string name(section.str());
    const std::string where = line_of(content, source);
    if (name == "preset") continue;
    if (!content.is_table()) {
      set_key(config, name, content, where);  // a key without a section: names the nearest
      continue;
    }
    for (const auto& [key, node] : *content.as_table())
      set_key(config, fmt::format("{}.{}", name, key.str()), node, line_of(node, source));
  }
}

std::string preset_of(const toml::table& table, const std::string& source) {
  const toml::node* node = table.get("preset");
  if (!node) return "standard";
  if (!node->is_string()) refuse("{}: preset must be demo, standard or quality", source);
  return **node->as_string();
}

/// What no single key can tell.
void check_together(const Config& config) {
  if (config.scene.far > 0 && config.scene.near >= config.scene.far)
    refuse("scene.near must be smaller than scene.far");
  for (const auto& [name, side] :
       {std::pair("scene", config.scene.plane_size), std::pair("human", config.human.plane_size)})
    if (side % 16 != 0) refuse("{}.plane_size must be a multiple of 16, it is {}", name, side);
}

std::string toml_value(std::int64_t value) { return std::to_string(value); }
std::string toml_value(bool value) { return value ? "true" : "false"; }
std::string toml_value(const std::string& value) { return fmt::format("\"{}\"", value); }
std::string toml_value(const std::vector<std::int64_t>& value) {
  return fmt::format("[{}]", fmt::join(value, ", "));
}
std::string toml_value(double value) {
  const std::string text = fmt::format("{}", value);  // the shortest that reads back the same
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

}  // namespace

Config preset_config(const std::string& preset) {
  std::vector<std::string> names;
  for (const Preset& known : presets()) {
    names.push_back(known.name);
    if (known.name != preset) continue;
    Config config;
    config.preset = preset;
    for (const std::string& setting : known.settings) apply_setting(config, setting, "preset " + preset);
    return config;
  }
  refuse("there is no preset '{}': use {}", preset, fmt::join(names, ", "));
}

Config parse_config(const std::string& preset, const std::string& text, const std::string& source,
                    const std::vector<std::string>& settings) {
  const toml::table table = parse_toml(text, source);
  Config config = preset_config(preset.empty() ? preset_of(table, source) : preset);
  apply_table(config, table, source);
  for (const std::string& setting : settings) apply_setting(config, setting, "--set");
  check_together(config);
  return config;
}

Config parse_run_config(const std::string& text, const std::string& source) {
  const toml::table table = parse_toml(text, source);
  std::vector<std::string> settings;
  for (const auto& [key, before] : {std::pair("scene.coarse_samples", "0"),
                                    {"scene.variation_weight", "0"},
                                    {"scene.distortion_weight", "0"},
                                    {"scene.plane_scales", "1"},
                                    {"scene.cameras", "given"},
                                    {"scene.ground", "false"},
                                    {"scene.exposure_rate", "0"},
                                    {"human.plane_scales", "1"},
                                    {"human.variation_weight", "0"},
                                    {"human.error_input", "observed"},
                                    {"human.shading", "false"},
                                    {"human.corrections", "learned"},
                                    {"human.mask_softness", "0"},
                                    {"human.unseen_views", "0"},
                                    {"scene.weight_threshold", "0"},
                                    {"scene.cooldown", "0"},
                                    {"human.cooldown", "0"},
                                    {"style.feature_weight", "1"},
                                    {"style.luma_weight", "8"}})
    if (!table.at_path(key)) settings.push_back(fmt::format("{}={}", key, before));
  if (!table.at_path("human.clothes_band"))  // the free band was that of both sides
    settings.push_back(fmt::format("human.clothes_band={}", table.at_path("human.free_band").value_or(0.02)));
  return parse_config("", text, source, settings);
}

Config load_config(const std::string& preset, const std::optional<std::filesystem::path>& file,
                   const std::vector<std::string>& settings) {
  Config config =
      parse_config(preset, file ? read_whole_file(*file) : "", file ? file->string() : "", settings);
  if (config.human.box_margin < config.human.threshold)  // runs that have trained so keep their box
    refuse("human.box_margin must not be smaller than human.threshold, or samples lie outside of the box");
  return config;
}

std::string to_toml(const Config& config) {
  Config copy = config;  // the table gives places to write to
  std::string text = fmt::format("preset = \"{}\"\n", config.preset);
  for (const ConfigSection& section : config_sections()) {
    text += fmt::format("\n# {}\n[{}]\n", section.help, section.name);
    for (const ConfigKey& key : section.keys) {
      const Setting setting = key.setting(copy);
      const std::string value = std::visit([](const auto* v) { return toml_value(*v); }, setting);
      text += fmt::format("{} = {}  # {} ({})\n", key.name.substr(section.name.size() + 1), value, key.help,
                          expected(key, setting));
    }
  }
  return text;
}

}  // namespace vivant
