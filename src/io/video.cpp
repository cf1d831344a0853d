#include "vivant/io/video.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "vivant/io/atomic_file.hpp"
#include "vivant/runtime/error.hpp"

extern char** environ;

namespace vivant {

namespace fs = std::filesystem;

namespace {

int even(int size) { return size + size % 2; }

/// Starts ffmpeg with `input` as its standard input and `log` as its standard error.
pid_t start_ffmpeg(const std::vector<std::string>& arguments, int input, int log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, log, STDERR_FILENO);
  // Its own process group: Ctrl-C reaches this program alone, which then ends the video.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t process = -1;
  const int error = posix_spawnp(&process, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error == ENOENT) fail("writing a video needs the program 'ffmpeg'; install the package ffmpeg");
  if (error != 0) fail("cannot start 'ffmpeg': {}", std::strerror(error));
  return process;
}

std::vector<std::string> ffmpeg_arguments(const fs::path& output, cv::Size size, double fps) {
  return {
      "ffmpeg", "-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s",
      fmt::format("{}x{}", even(size.width), even(size.height)), "-r", fmt::format("{}", fps), "-i", "pipe:0",
      // BT.601 coefficients, declared as such: browsers read the declaration, OpenCV assumes them.
      "-vf", "scale=out_color_matrix=bt601:out_range=tv", "-colorspace", "smpte170m", "-color_primaries",
      "bt709", "-color_trc", "bt709", "-color_range", "tv", "-c:v", "libx264", "-preset", "medium", "-crf",
      "17", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", fs::absolute(output).string()};
}

}  // namespace

VideoWriter::VideoWriter(fs::path path, cv::Size size, double fps)
    : path_(std::move(path)), temporary_(temporary_name(path_)), size_(size) {
  if (size.width < 1 || size.height < 1)
    fail("'{}': a video of {}x{} is not possible", path_.string(), size.width, size.height);
  if (!(fps > 0) || !std::isfinite(fps))
    fail("'{}': a frame rate of {} is not possible", path_.string(), fps);
  if (path_.extension() != ".mp4")
    throw UsageError(fmt::format("'{}': videos are written as .mp4", path_.string()));
  AtomicFile probe(path_);  // an unwritable folder is reported before any frame is rendered
  // A socket rather than a pipe: writing to an ffmpeg that has died then gives an error instead of a signal.
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    fail("cannot make a pipe: {}", std::strerror(errno));
  log_ = ::memfd_create("ffmpeg-log", MFD_CLOEXEC);
  pipe_ = ends[0];
  try {
    process_ = start_ffmpeg(ffmpeg_arguments(temporary_, size, fps), ends[1], log_);
  } catch (const Error&) {
    for (int descriptor : {ends[0], ends[1], log_}) ::close(descriptor);
    throw;
  }
  ::close(ends[1]);
}

VideoWriter::~VideoWriter() {
  if (process_ > 0) {
    ::kill(process_, SIGKILL);
    finish();
    std::error_code ignored;
    fs::remove(temporary_, ignored);
  }
  if (log_ >= 0) ::close(log_);
}

void VideoWriter::write(const cv::Mat& frame) {
  if (process_ < 0) fail("'{}': the video is closed already", path_.string());
  if (frame.type() != CV_8UC3 || frame.size() != size_) {
    fail("'{}': a frame of {}x{} in a video of {}x{}", path_.string(), frame.cols, frame.rows, size_.width,
         size_.height);
  }
  cv::Mat padded;
  cv::copyMakeBorder(frame, padded, 0, size_.height % 2, 0, size_.width % 2, cv::BORDER_REPLICATE);
  const char* bytes = padded.ptr<char>();
  std::size_t left = padded.total() * padded.elemSize();
  while (left > 0) {
    const ssize_t sent = ::send(pipe_, bytes, left, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) {
      finish();
      fail_with_log();
    }
    bytes += sent;
    left -= static_cast<std::size_t>(sent);
  }
}

void VideoWriter::close() {
  if (process_ < 0) return;
  if (!finish()) fail_with_log();
  replace_file(temporary_, path_);
}

bool VideoWriter::finish() {
  ::close(pipe_);
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void VideoWriter::fail_with_log() {
  std::error_code ignored;
  fs::remove(temporary_, ignored);
  char text[400] = {};
  const ssize_t size = ::pread(log_, text, sizeof(text) - 1, 0);
  std::string why(text, size > 0 ? static_cast<std::size_t>(size) : 0);
  why = why.substr(0, why.find('\n'));
  fail("cannot write '{}': ffmpeg ended early{}{}", path_.string(), why.empty() ? "" : ": ", why);
}

VideoReader::VideoReader(const fs::path& path) {
  if (!fs::exists(path)) fail("'{}' does not exist", path.string());
  if (!capture_.open(path.string(), cv::CAP_FFMPEG))
    fail("'{}' is not a video that can be read", path.string());
  fps_ = capture_.get(cv::CAP_PROP_FPS);
  size_ = cv::Size(static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_WIDTH)),
                   static_cast<int>(capture_.get(cv::CAP_PROP_FRAME_HEIGHT)));
}

std::optional<cv::Mat> VideoReader::next() {
  cv::Mat frame;
  if (!capture_.read(frame)) return std::nullopt;
  cv::cvtColor(frame, frame, cv::COLOR_BGR2RGB);
  return frame;
}

}  // namespace vivant
