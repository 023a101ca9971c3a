#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

namespace groundray {

/// Start of a run.
struct RunBegin {
  std::filesystem::path scene, output;
  std::uint64_t seed = 0;
  std::string shard;       ///< "2/8"; empty for a whole run
  std::size_t frames = 0;  ///< number of frames to be made
  std::size_t there = 0;   ///< number of frames that exist already
};

/// Frame that has been written.
struct FrameDone {
  std::string sensor;
  std::int64_t frame = 0;
  std::string_view samples;  ///< unit of `count`: "points" or "pixels"
  std::uint64_t count = 0, bytes = 0;
  std::chrono::duration<double> tracing{0}, writing{0};
  std::chrono::duration<double> writing_cpu{0};  ///< processor time of the writing thread
};

/// Log of a run for programs: one JSON object per line (docs/reference/runs.md). Any number of
/// threads may use it. Errors of the file after it was opened are ignored, because the run is more
/// important.
class RunLog {
 public:
  /// @param target  file to append to, "-" for standard output, or empty for no log.
  /// @throws Error if the file cannot be written.
  explicit RunLog(const std::string& target);

  /// Returns true if the log is written to standard output.
  bool takes_output() const noexcept { return out_ == stdout; }

  void begun(const RunBegin& run);
  void frame_done(const FrameDone& frame);
  /// @param how      "end", "interrupted" or "failed".
  /// @param message  text for the user, or empty.
  void ended(std::string_view how, std::string_view message);

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  void write(const std::string& line);

  std::unique_ptr<std::FILE, CloseFile> file_;
  std::FILE* out_ = nullptr;
  std::mutex mutex_;
  std::size_t frames_ = 0, done_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace groundray
