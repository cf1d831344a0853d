#pragma once
#include <filesystem>
#include <string_view>

namespace vivant {

/// Where a file that comes with the program lies ("body.safetensors", "styles/impasto.jpg"). Looks in the
/// folder named by the environment variable VIVANT_ASSETS when it is set; otherwise beside the executable
/// (../share/vivant/assets), then in the source tree that the program was built from. Throws Error naming the
/// folders searched.
std::filesystem::path asset_path(std::string_view name);

}  // namespace vivant
