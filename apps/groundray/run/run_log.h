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

/// What a run is about to do.
struct RunBegin {
  std::filesystem::path scene, output;
  std::uint64_t seed = 0;
  std::string shard;       ///< "2/8"; empty for all
  std::size_t frames = 0;  ///< to be made
  std::size_t there = 0;   ///< that need not be made again
};

/// A frame that is on the disk.
struct FrameDone {
  std::string sensor;
  std::int64_t frame = 0;
  std::string_view samples;  ///< what is counted: "points" or "pixels"
  std::uint64_t count = 0, bytes = 0;
  std::chrono::duration<double> tracing{0}, writing{0};
  std::chrono::duration<double> writing_cpu{0};  ///< of the thread that writes
};

/// Tells programs how a run goes: one JSON object a line (docs/runs.md). Any number of threads may
/// use one. Faults of the file are ignored once it is open, for the run matters more.
class RunLog {
 public:
  /// @param target  a file, to whose end lines are added, "-" for standard output, or empty for
  /// none.
  /// @throws Error if the file cannot be written.
  explicit RunLog(const std::string& target);

  /// Whether it takes standard output for itself.
  bool takes_output() const noexcept { return out_ == stdout; }

  void begun(const RunBegin& run);
  void frame_done(const FrameDone& frame);
  /// @param how  "end", "interrupted" or "failed". @param message  for people, may be empty.
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
