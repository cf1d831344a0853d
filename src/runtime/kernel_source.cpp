#include "runtime/kernel_source.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "runtime/embedded_kernels.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

std::string raw_text(const std::string& file) {
  if (const char* folder = std::getenv("VIVANT_KERNELS"); folder && *folder) {
    std::ifstream in(std::filesystem::path(folder) / file);
    if (!in) fail("no kernel file {} in the folder VIVANT_KERNELS={}", file, folder);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  for (const EmbeddedFile& embedded : embedded_kernels())
    if (embedded.name == file) return std::string(embedded.text);
  fail("no kernel file {} is embedded in this program", file);
}

void expand(const std::string& file, std::set<std::string>& seen, std::string& out) {
  if (!seen.insert(file).second) return;
  std::istringstream lines(raw_text(file));
  for (std::string line; std::getline(lines, line);) {
    const std::string start = "#include \"";
    if (line.rfind(start, 0) == 0)
      expand(line.substr(start.size(), line.find('"', start.size()) - start.size()), seen, out);
    else
      out += line + "\n";
  }
}

}  // namespace

std::string kernel_source(const std::string& file) {
  std::set<std::string> seen;
  std::string out;
  expand(file, seen, out);
  return out;
}

}  // namespace vivant
