#pragma once

#include <exception>
#include <future>
#include <utility>

#include "core/error.h"

namespace groundray {

/// Does one job after the other on a thread beside the caller's: while one is under way, the next
/// waits, and with it whoever brings it.
class BackgroundWriter {
 public:
  /// Begins a job once the one before is done.
  /// @throws what that one threw; the job is then not begun.
  template <typename Job>
  void begin(Job&& job) {
    wait();
    job_ = std::async(std::launch::async, std::forward<Job>(job));
  }

  /// Waits until the job is done. @throws what it threw, once.
  void wait() {
    if (job_.valid()) job_.get();
  }

  /// Waits, for a caller that has failed itself.
  /// @throws the caller's fault and the job's as one Error, if both are such; else the job's, if
  /// there is one, and the caller's, if there is none.
  [[noreturn]] void fail(const std::exception_ptr& callers) {
    try {
      wait();
    } catch (const std::exception& own) {
      try {
        std::rethrow_exception(callers);
      } catch (const std::exception& fault) {
        throw Error("{}\n{}", fault.what(), own.what());
      } catch (...) {
        // The caller was only asked to stop.
      }
      throw;
    }
    std::rethrow_exception(callers);
  }

 private:
  std::future<void> job_;  // of std::async: its end is waited for
};

}  // namespace groundray
