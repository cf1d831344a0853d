#include "vivant/jobs/progress.hpp"

#include <unistd.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "child_process.hpp"
#include "jobs/progress_bar.hpp"
#include "vivant/jobs/interrupt.hpp"

using namespace vivant;

TEST_CASE("progress: the bar shows what is known and never exceeds the terminal") {
  BarContent content{.stage = "reconstruct", .step = 750, .steps = 1000, .loss = 0.01234, .psnr = 21.96};
  content.rays_per_second = 143400;
  content.seconds_left = 192;
  content.memory_bytes = std::size_t{1} << 30;
  const std::string wide = bar_text(content, 200);
  CHECK(
      wide ==
      "reconstruct [##############################----------] 750/1000  loss 0.01234  22.0 dB  143k rays/s  "
      "03:12 left  1024 MiB");
  for (int width = 0; width < 130; ++width) {
    const std::string text = bar_text(content, width);
    CHECK(text.size() <= static_cast<std::size_t>(width));
    CHECK(contains(text, "\n") == false);
  }
  CHECK(contains(bar_text({.stage = "render", .step = 0, .steps = 0}, 60), "render [####"));
  CHECK(duration_text(3723) == "1:02:03");
  CHECK(duration_text(59.6) == "01:00");
  CHECK(resident_memory_bytes() > 1 << 20);
}

TEST_CASE("progress: metrics and messages are recorded in the run folder") {
  const TemporaryFolder folder;
  const RunFolder run = RunFolder::create(folder / "run", "");
  for (std::int64_t half : {0, 1}) {  // the second time, as a resumed run, adds to the first
    Progress progress(ProgressMode::none, false);
    progress.record_in(run);
    progress.begin("reconstruct", half * 10, 20);
    progress.report(
        {.step = half * 10 + 10, .loss = 0.5, .psnr = 20, .rays = 4096, .more = {{"mask", 0.25}}});
    progress.end();
    progress.detail("half " + std::to_string(half));
  }
  std::istringstream rows(read_whole_file(run.metrics()));
  std::int64_t count = 0;
  for (std::string text; std::getline(rows, text); ++count) {
    const auto row = nlohmann::json::parse(text);
    CHECK(row["stage"] == "reconstruct");
    CHECK(row["step"] == 10 * (count + 1));
    CHECK(row["loss"] == 0.5);
    CHECK(row["mask"] == 0.25);
    CHECK(row["rays_per_second"].get<double>() > 0);
  }
  CHECK(count == 2);
  CHECK(contains(read_whole_file(run.log()), "half 0"));
  CHECK(contains(read_whole_file(run.log()), "half 1"));
}

TEST_CASE("progress: modes by name") {
  CHECK(progress_mode_from("auto") == ProgressMode::automatic);
  CHECK(progress_mode_from("json") == ProgressMode::json);
  CHECK_THROWS_AS(progress_mode_from("fancy"), UsageError);
}

TEST_CASE("interrupt: a signal sets the flag, and the former handler comes back") {
  const auto before = std::signal(SIGTERM, SIG_IGN);
  {
    const InterruptGuard guard;
    CHECK_FALSE(interrupted());
    { const InterruptGuard within; }
    std::raise(SIGTERM);  // caught, though the inner guard has gone
    CHECK(interrupted());
    const InterruptGuard later;  // a job within a job that was stopped
    CHECK(interrupted());
  }
  std::raise(SIGTERM);  // ignored again, else this ends the test program
  {
    const InterruptGuard guard;
    CHECK_FALSE(interrupted());
  }
  CHECK((std::signal(SIGTERM, before) == SIG_IGN));
}

TEST_CASE("interrupt: the second signal ends the program at once with 130") {
  const pid_t child = fork();
  if (child == 0) {
    const InterruptGuard guard;
    std::raise(SIGINT);
    std::raise(SIGINT);
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 130);
}
