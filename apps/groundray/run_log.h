#pragma once

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/io/open_file.h"

namespace groundray {

/// Fields of a line of a log. They are kept as text, because the destructors of JSON's containers
/// allocate, which ends the program if there is not enough memory.
class LogFields {
 public:
  /// Adds a number or a text, whose bytes that are not UTF-8 are replaced.
  template <typename Value>
  void add(std::string_view key, const Value& value) {
    using Json = nlohmann::json;
    text_ += fmt::format(",\"{}\":{}", key,
                         Json(value).dump(-1, ' ', false, Json::error_handler_t::replace));
  }
  /// Returns `,"key":value` for each field.
  const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
};

/// Log of a run for programs: one JSON object per line (docs/reference/runs.md). Any number of
/// threads may use it. The run goes on if the file cannot be written later, which is reported
/// once.
class RunLog {
 public:
  /// @param target  file to append to, "-" for standard output, or empty for no log.
  /// @throws Error if the file cannot be written, is a pipe without a reader, or has other content.
  explicit RunLog(const std::string& target);

  /// Returns true if the log is written to standard output.
  bool takes_output() const noexcept { return out_ == stdout; }

  /// Records the start of a run.
  /// @param frames  number of frames to be made.
  /// @param run     more about it.
  void begun(std::size_t frames, const LogFields& run);
  /// Records a frame that has been written.
  void frame_done(LogFields frame);
  /// @param how      "end", "interrupted" or "failed".
  /// @param message  text for the user, or empty.
  void ended(std::string_view how, const std::string& message);

 private:
  void write(std::string_view event, const LogFields& fields);

  OwnedFile file_;
  std::FILE* out_ = nullptr;
  std::mutex mutex_;
  std::size_t frames_ = 0, done_ = 0;
  bool has_failed_ = false;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Returns a duration in seconds, rounded to milliseconds, for a log.
double log_seconds(std::chrono::duration<double> time);

}  // namespace groundray
