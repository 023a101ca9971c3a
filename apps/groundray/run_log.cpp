#include "apps/groundray/run_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/error.h"

namespace groundray {

RunLog::RunLog(const std::string& target) {
  if (target.empty()) return;
  if (target == "-") {
    out_ = stdout;
    std::signal(SIGPIPE, SIG_IGN);  // a closed pipe must not end the run
    return;
  }
  file_.reset(std::fopen(target.c_str(), "ab"));
  if (!file_) {
    throw Error("{}: cannot be written: {}; choose another file with --log-json", target,
                std::generic_category().message(errno));
  }
  out_ = file_.get();
}

void RunLog::begun(std::size_t frames, const Json& run) {
  const std::lock_guard lock(mutex_);
  frames_ = frames;
  write("begin", run);
}

void RunLog::frame_done(const Json& frame) {
  const std::lock_guard lock(mutex_);
  Json fields = frame;
  fields["done"] = ++done_;
  fields["frames"] = frames_;
  write("frame", fields);
}

void RunLog::ended(std::string_view how, const std::string& message) {
  const std::lock_guard lock(mutex_);
  Json fields = Json::object();
  if (!message.empty()) fields["message"] = message;
  fields["done"] = done_;
  fields["frames"] = frames_;
  fields["elapsed_s"] = log_seconds(std::chrono::steady_clock::now() - begin_);
  write(how, fields);
}

void RunLog::write(std::string_view event, const Json& fields) {
  if (out_ == nullptr) return;
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto second = std::chrono::floor<std::chrono::seconds>(now);
  Json object{
      {"event", event},
      {"time", fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(second.time_since_epoch().count()),
                           (now - second).count())}};
  object.update(fields);
  // Names of files may have any bytes: invalid UTF-8 is replaced.
  const std::string line = object.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::fwrite(line.data(), 1, line.size(), out_);
  std::fflush(out_);
  std::clearerr(out_);  // a log that cannot be written does not make the run fail
}

double log_seconds(std::chrono::duration<double> time) {
  return std::chrono::duration<double>(std::chrono::round<std::chrono::milliseconds>(time)).count();
}

}  // namespace groundray
