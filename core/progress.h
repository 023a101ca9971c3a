#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

namespace groundray {

/// Reports long work: on a terminal one line that is redrawn with rate and time left, elsewhere a plain line now and
/// then. One thread at a time may call it.
class Progress {
 public:
  /// @param out    where to report; nullptr for nowhere.
  /// @param label  what is being done: "scans".
  /// @param total  how many steps there are.
  Progress(std::FILE* out, std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Notes that `done` of the steps are done.
  void update(std::uint64_t done);

 private:
  std::FILE* out_;
  bool terminal_;
  std::string label_;
  std::uint64_t total_;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point reported_;
};

/// Returns a duration as people write it: "0.4 s", "12 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(std::chrono::duration<double> duration);

}  // namespace groundray
