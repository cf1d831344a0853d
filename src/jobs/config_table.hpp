#pragma once
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "vivant/jobs/config.hpp"

namespace vivant {

/// Where a key's value lies; its type is the key's type.
using Setting = std::variant<std::int64_t*, double*, bool*, std::string*, std::vector<std::int64_t>*>;

struct ConfigKey {
  std::string name;  ///< "scene.plane_size"
  std::function<Setting(Config&)> setting;
  double lowest = 0, highest = 0;  ///< of numbers
  std::string choices;             ///< of texts: "full|occupied|vanilla"
  std::string help;
};

struct ConfigSection {
  std::string name, help;
  std::vector<ConfigKey> keys;
};

/// The content of config_keys.def.
const std::vector<ConfigSection>& config_sections();

/// Null when there is none of this name.
const ConfigKey* find_config_key(const std::string& name);

/// The known key that is most like `name`.
std::string nearest_config_key(const std::string& name);

}  // namespace vivant
