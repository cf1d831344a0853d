#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "vivant/io/checkpoint.hpp"

namespace vivant {

/// The folder of a run. It holds all that rendering needs, so it can be moved; the capture's pictures alone,
/// for training and evaluation, stay where they are and are named by their absolute paths:
///   config.toml  metrics.jsonl  log.txt  checkpoints/  previews/  capture/  styles/  lock
class RunFolder {
 public:
  /// Makes a new run with this configuration. Throws when the folder already holds a run, or cannot be made.
  /// `fill` puts into the folder what a run needs from the start; config.toml, by which a run is known, comes
  /// last.
  static RunFolder create(const std::filesystem::path& path, const std::string& config_toml,
                          const std::function<void(const std::filesystem::path&)>& fill = {});
  /// Opens a run to go on with it. Throws when there is none, and while another process writes to it.
  static RunFolder open_to_write(const std::filesystem::path& path);
  /// Opens a run to look at it, which is possible while another process writes to it.
  static RunFolder open_to_read(const std::filesystem::path& path);

  RunFolder(RunFolder&& other) noexcept;
  RunFolder& operator=(RunFolder&&) = delete;
  ~RunFolder();

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path config() const { return path_ / "config.toml"; }
  std::filesystem::path metrics() const { return path_ / "metrics.jsonl"; }
  std::filesystem::path log() const { return path_ / "log.txt"; }
  std::filesystem::path previews() const { return path_ / "previews"; }
  std::filesystem::path capture() const { return path_ / "capture"; }
  std::filesystem::path styles() const { return path_ / "styles"; }

  /// Writes a checkpoint under the number of steps done in the whole run, all stages together, and deletes
  /// all but the last `kept`. Returns its path.
  std::filesystem::path save(const Checkpoint& checkpoint, std::int64_t number, std::int64_t kept) const;
  /// The checkpoints' files, oldest first.
  std::vector<std::filesystem::path> checkpoints() const;

  struct Newest {
    std::int64_t number = 0;
    Checkpoint checkpoint;
    std::vector<std::string>
        damaged;  ///< what is wrong with newer files that were passed over, one line each
  };
  /// The newest checkpoint that is whole; none when there is no checkpoint yet. Throws when there are some,
  /// all of them damaged.
  std::optional<Newest> newest_checkpoint() const;

  /// Ends metrics.jsonl after the row of this stage and step, as resuming there will write the later ones
  /// again. A row cut short by a crash goes, too.
  void rewind_metrics(const std::string& stage, std::int64_t step) const;

 private:
  explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) {}
  void lock();

  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace vivant
