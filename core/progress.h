#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>

namespace groundray {

/// Reports the progress of long work: on a terminal one line, `scans 3/10, 2.1/s, 3 s left`,
/// redrawn at most ten times a second; elsewhere a plain line at most every 5 s; and one at the
/// end. Errors of the stream are ignored so that the work continues. Only one thread at a time may
/// call it.
class Progress {
 public:
  /// @param out    stream to report to; nullptr for none. Must outlive this.
  /// @param label  name of the steps: "scans".
  /// @param total  number of steps.
  Progress(std::FILE* out, std::string label, std::uint64_t total);
  /// Ends the line if work stopped early, so that later output begins on a new line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Records that `done` steps are complete.
  void update(std::uint64_t done);
  /// Shows another line instead of the steps, if it is time for one.
  /// @param line  returns the text: "scans 3/10, images 1/2, 3 s left".
  void show(const std::function<std::string()>& line);
  /// Shows the last line, whatever the time.
  void end(const std::string& line);

 private:
  bool is_due();
  void draw(const std::string& line);

  std::FILE* out_;
  bool terminal_;
  bool finished_ = false;
  std::string label_;
  std::uint64_t total_;
  std::size_t drawn_width_ = 0;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point reported_;
};

/// Returns a duration in readable form: "0.4 s", "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(std::chrono::duration<double> duration);

}  // namespace groundray
