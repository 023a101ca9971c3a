#include "apps/groundray/run_log.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <new>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "core/io/open_file.h"
#include "core/io/print_error.h"

namespace groundray {
namespace {

// Refuses a file whose content is not a log's, which the log would spoil: a scene, say.
void refuse_other_text(const std::string& target) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(target, ignored)) return;
  constexpr std::string_view begin = R"({"event":)";
  std::string found(begin.size(), '\0');
  std::ifstream file = open_stream(target);
  file.read(found.data(), static_cast<std::streamsize>(found.size()));
  if (file.gcount() == 0 || found == begin) return;
  throw Error(
      "{}: it is not a log, to which lines are appended; choose another file with --log-json",
      target);
}

}  // namespace

RunLog::RunLog(const std::string& target) {
  if (target.empty()) return;
  if (target == "-") {
    out_ = stdout;
    std::signal(SIGPIPE, SIG_IGN);  // a closed pipe must not end the run
    return;
  }
  refuse_other_text(target);
  // A pipe without a reader fails instead of waiting.
  const int descriptor =
      open(target.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    throw Error(
        "{}: cannot be written: {}; choose another file with --log-json", target,
        errno == ENXIO ? "it is a pipe that nobody reads" : std::generic_category().message(errno));
  }
  fcntl(descriptor, F_SETFL, O_APPEND);
  file_.reset(fdopen(descriptor, "ab"));
  if (!file_) throw std::bad_alloc();
  out_ = file_.get();
}

void RunLog::begun(std::size_t frames, const LogFields& run) {
  const std::lock_guard lock(mutex_);
  frames_ = frames;
  write("begin", run);
}

void RunLog::frame_done(LogFields frame) {
  const std::lock_guard lock(mutex_);
  frame.add("done", ++done_);
  frame.add("frames", frames_);
  write("frame", frame);
}

void RunLog::ended(std::string_view how, const std::string& message) {
  const std::lock_guard lock(mutex_);
  LogFields fields;
  if (!message.empty()) fields.add("message", message);
  fields.add("done", done_);
  fields.add("frames", frames_);
  fields.add("elapsed_s", log_seconds(std::chrono::steady_clock::now() - begin_));
  write(how, fields);
}

void RunLog::write(std::string_view event, const LogFields& fields) {
  if (out_ == nullptr) return;
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto second = std::chrono::floor<std::chrono::seconds>(now);
  const std::string line = fmt::format("{{\"event\":\"{}\",\"time\":\"{:%FT%T}.{:03}Z\"{}}}\n",
                                       event, fmt::gmtime(second.time_since_epoch().count()),
                                       (now - second).count(), fields.text());
  std::fwrite(line.data(), 1, line.size(), out_);
  if (std::fflush(out_) != 0 && !std::exchange(has_failed_, true) && out_ != stdout)
    print_error("groundray: the log cannot be written: {}\n",
                std::generic_category().message(errno));
  std::clearerr(out_);  // this does not make the run fail
}

double log_seconds(std::chrono::duration<double> time) {
  return std::chrono::duration<double>(std::chrono::round<std::chrono::milliseconds>(time)).count();
}

}  // namespace groundray
