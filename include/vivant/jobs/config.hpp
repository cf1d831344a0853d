#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vivant {

/// All settings of a run. The members come from config_keys.def (config.scene.plane_size and so on), which
/// also says what each means and its range; they start with the standard values.
struct Config {
  std::string preset = "standard";

// clang-format off
#define SECTION(Type, name, help) struct Type { bool operator==(const Type&) const = default;
#define INTEGER(name, standard, lowest, highest, help) std::int64_t name = standard;
#define REAL(name, standard, lowest, highest, help) double name = standard;
#define FLAG(name, standard, help) bool name = standard;
#define CHOICE(name, standard, choices, help) std::string name = standard;
#define LIST(...) {__VA_ARGS__}
#define INTEGERS(name, standard, lowest, highest, help) std::vector<std::int64_t> name = standard;
#define END(name) } name;
  // clang-format on
#include "vivant/jobs/config_keys.def"

  bool operator==(const Config&) const = default;
};

/// What is not the same in every preset: demo (small and quick), standard, quality. Throws UsageError for
/// others.
Config preset_config(const std::string& preset);

/// The settings "key=value" over the TOML file over the preset; an empty `preset` stands for the file's, else
/// for standard. Throws UsageError for unknown keys, naming the nearest known one, and for values of another
/// type or out of range.
Config load_config(const std::string& preset, const std::optional<std::filesystem::path>& file,
                   const std::vector<std::string>& settings);

/// The same from a TOML text; `source` names it in messages.
Config parse_config(const std::string& preset, const std::string& text, const std::string& source,
                    const std::vector<std::string>& settings = {});

/// The configuration that a run keeps. It names every key, unless an older program wrote it: what came later
/// has the value then that the run was trained with, not today's standard.
Config parse_run_config(const std::string& text, const std::string& source);

/// Every key with its value, and what it means as a comment. parse_config gives the same Config back.
std::string to_toml(const Config& config);

}  // namespace vivant
