#include "vivant/jobs/open_run.hpp"

#include "vivant/io/atomic_file.hpp"
#include "vivant/jobs/stage.hpp"

namespace vivant {

OpenRun open_run(Device& device, const std::filesystem::path& path, Progress& progress) {
  RunFolder folder = RunFolder::open_to_read(path);
  Config config = parse_run_config(read_whole_file(folder.config()), folder.config().string());
  Capture given = load_capture(folder.capture(), PictureCheck::when_read);
  auto model = std::make_unique<CaptureModel>(device, config, given);
  const auto newest = folder.newest_checkpoint();
  if (!newest)
    fail("{} has no checkpoint yet: train it with vivant train --resume --run {}", path.string(),
         path.string());
  for (const std::string& damaged : newest->damaged) progress.warn(damaged);
  restore_training(newest->checkpoint, model->store());
  Capture capture = model->corrected(given);
  const std::string& stage = newest->checkpoint.stage;
  return {std::move(folder),
          std::move(config),
          std::move(given),
          std::move(capture),
          std::move(model),
          newest->checkpoint.source,
          stage == "features" || stage == "style"};
}

}  // namespace vivant
