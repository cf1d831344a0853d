#include "vivant/io/assets.hpp"

#include <cstdlib>
#include <string>
#include <system_error>
#include <vector>

#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> asset_folders() {
  if (const char* folder = std::getenv("VIVANT_ASSETS"); folder != nullptr && *folder != '\0')
    return {folder};
  std::vector<fs::path> folders;
  std::error_code ignored;
  const fs::path executable = fs::read_symlink("/proc/self/exe", ignored);
  if (!executable.empty()) {
    folders.push_back(executable.parent_path().parent_path() / "share" / "vivant" / "assets");
  }
  folders.push_back(VIVANT_SOURCE_ASSETS);
  return folders;
}

}  // namespace

fs::path asset_path(std::string_view name) {
  std::string searched;
  for (const fs::path& folder : asset_folders()) {
    std::error_code ignored;
    if (fs::exists(folder / name, ignored)) return folder / name;
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  fail("the asset {} is missing (searched in {}); set VIVANT_ASSETS to the folder that holds it", name,
       searched);
}

}  // namespace vivant
