#include "vivant/jobs/run_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <sstream>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view extension = ".safetensors";

fs::path checkpoint_folder(const fs::path& run) { return run / "checkpoints"; }

/// The number in "00001200.safetensors"; -1 for other names, such as those of unfinished files.
std::int64_t number_of(const fs::path& file) {
  const std::string name = file.filename().string();
  std::int64_t number = -1;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc() && std::string_view(end) == extension;
  return whole ? number : -1;
}

}  // namespace

RunFolder RunFolder::create(const fs::path& path, const std::string& config_toml,
                            const std::function<void(const fs::path&)>& fill) {
  RunFolder run(path);
  if (fs::exists(run.config()))
    fail("'{}' already holds a run: go on with it by --resume, or choose another folder", path.string());
  for (const fs::path& folder : {path, checkpoint_folder(path), run.previews(), run.capture()})
    make_folder(folder);
  run.lock();
  if (fill) fill(path);
  write_text_file(run.config(), config_toml);
  return run;
}

RunFolder RunFolder::open_to_read(const fs::path& path) {
  RunFolder run(path);
  if (!fs::is_directory(path)) fail("there is no run folder '{}'", path.string());
  if (!fs::exists(run.config()))
    fail("'{}' is not the folder of a run: it has no config.toml", path.string());
  return run;
}

RunFolder RunFolder::open_to_write(const fs::path& path) {
  RunFolder run = open_to_read(path);
  run.lock();
  make_folder(run.previews());  // copies of runs often lack what was an empty folder
  return run;
}

RunFolder::RunFolder(RunFolder&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

RunFolder::~RunFolder() {
  if (lock_ >= 0) ::close(lock_);  // which releases the lock, as does the end of the process, however it ends
}

void RunFolder::lock() {
  const fs::path file = path_ / "lock";
  lock_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) fail("cannot write into the run folder '{}'", path_.string());
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0)
    fail("another process is writing to the run '{}': wait for it, or stop it", path_.string());
}

fs::path RunFolder::save(const Checkpoint& checkpoint, std::int64_t number, std::int64_t kept) const {
  const fs::path saved = checkpoint_folder(path_) / fmt::format("{:08}{}", number, extension);
  save_checkpoint(saved, checkpoint);
  const std::vector<fs::path> files = checkpoints();
  for (std::size_t i = 0; i + kept < files.size(); ++i) fs::remove(files[i]);
  return saved;
}

std::vector<fs::path> RunFolder::checkpoints() const {
  std::vector<fs::path> files;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(checkpoint_folder(path_), none))
    if (number_of(entry.path()) >= 0) files.push_back(entry.path());
  std::sort(files.begin(), files.end(),
            [](const fs::path& a, const fs::path& b) { return number_of(a) < number_of(b); });
  return files;
}

std::optional<RunFolder::Newest> RunFolder::newest_checkpoint() const {
  std::vector<fs::path> files = checkpoints();
  Newest newest;
  for (; !files.empty(); files.pop_back()) {
    try {
      newest.checkpoint = load_checkpoint(files.back());
      newest.number = number_of(files.back());
      return newest;
    } catch (const Error& error) {
      newest.damaged.push_back(error.what());
    }
  }
  if (newest.damaged.empty()) return std::nullopt;
  fail("no checkpoint of the run '{}' can be used: {}", path_.string(), newest.damaged.front());
}

void RunFolder::rewind_metrics(const std::string& stage, std::int64_t step) const {
  if (!fs::exists(metrics())) return;
  std::istringstream rows(read_whole_file(metrics()));
  std::size_t seen = 0, kept = 0;
  for (std::string row; std::getline(rows, row) && !rows.eof();) {  // a row without its end is cut short
    const nlohmann::json values = nlohmann::json::parse(row, nullptr, false);
    if (!values.is_object()) break;
    seen += row.size() + 1;
    if (values.value("stage", "") == stage && values.value("step", std::int64_t{0}) <= step) kept = seen;
  }
  fs::resize_file(metrics(), kept);  // the same file: somebody may have opened it to append
}

}  // namespace vivant
