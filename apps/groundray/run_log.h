#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "core/io/open_file.h"

namespace groundray {

/// Log of a run for programs: one JSON object per line (docs/reference/runs.md). Any number of
/// threads may use it. Errors of the file after it was opened are ignored, because the run is more
/// important.
class RunLog {
 public:
  using Json = nlohmann::ordered_json;

  /// @param target  file to append to, "-" for standard output, or empty for no log.
  /// @throws Error if the file cannot be written, is a pipe without a reader, or has other content.
  explicit RunLog(const std::string& target);

  /// Returns true if the log is written to standard output.
  bool takes_output() const noexcept { return out_ == stdout; }

  /// Records the start of a run.
  /// @param frames  number of frames to be made.
  /// @param run     more about it.
  void begun(std::size_t frames, const Json& run);
  /// Records a frame that has been written.
  void frame_done(const Json& frame);
  /// @param how      "end", "interrupted" or "failed".
  /// @param message  text for the user, or empty.
  void ended(std::string_view how, const std::string& message);

 private:
  void write(std::string_view event, const Json& fields);

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
