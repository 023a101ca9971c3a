#include "apps/groundray/run/run_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "core/error.h"

namespace groundray {
namespace {

using Json = nlohmann::ordered_json;

// Rounds to milliseconds.
double rounded_s(std::chrono::duration<double> time) {
  return std::chrono::duration<double>(std::chrono::round<std::chrono::milliseconds>(time)).count();
}

Json event(std::string_view name) {
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto second = std::chrono::floor<std::chrono::seconds>(now);
  return {{"event", name},
          {"time", fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(second.time_since_epoch().count()),
                               (now - second).count())}};
}

// Names of files may have any bytes: invalid UTF-8 is replaced.
std::string line_of(const Json& object) {
  return object.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

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

void RunLog::begun(const RunBegin& run) {
  const std::lock_guard lock(mutex_);
  frames_ = run.frames;
  Json object = event("begin");
  object["version"] = GROUNDRAY_VERSION;
  object["scene"] = run.scene.string();
  object["output"] = run.output.string();
  object["seed"] = run.seed;
  if (!run.shard.empty()) object["shard"] = run.shard;
  object["frames"] = run.frames;
  object["there"] = run.there;
  write(line_of(object));
}

void RunLog::frame_done(const FrameDone& frame) {
  const std::lock_guard lock(mutex_);
  Json object = event("frame");
  object["sensor"] = frame.sensor;
  object["frame"] = frame.frame;
  object["tracing_s"] = rounded_s(frame.tracing);
  object["writing_s"] = rounded_s(frame.writing);
  object["writing_cpu_s"] = rounded_s(frame.writing_cpu);
  object[std::string(frame.samples)] = frame.count;
  object["bytes"] = frame.bytes;
  object["done"] = ++done_;
  object["frames"] = frames_;
  write(line_of(object));
}

void RunLog::ended(std::string_view how, std::string_view message) {
  const std::lock_guard lock(mutex_);
  Json object = event(how);
  if (!message.empty()) object["message"] = message;
  object["done"] = done_;
  object["frames"] = frames_;
  object["elapsed_s"] = rounded_s(std::chrono::steady_clock::now() - begin_);
  write(line_of(object));
}

void RunLog::write(const std::string& line) {
  if (out_ == nullptr) return;
  std::fwrite(line.data(), 1, line.size(), out_);
  std::fflush(out_);
}

}  // namespace groundray
