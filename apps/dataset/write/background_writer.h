#pragma once

#include <exception>
#include <future>
#include <utility>

#include "core/error.h"

namespace groundray {

/// Executor of one job at a time on a second thread. Starting a job blocks until the previous one
/// has ended.
class BackgroundWriter {
 public:
  /// Starts a job when the previous one has ended.
  /// @throws the previous job's exception; the new job is then not started.
  template <typename Job>
  void begin(Job&& job) {
    wait();
    job_ = std::async(std::launch::async, std::forward<Job>(job));
  }

  /// Waits until the job has ended.
  /// @throws its exception, once.
  void wait() {
    if (job_.valid()) job_.get();
  }

  /// Waits for the job after the caller itself has failed.
  /// @throws one Error with both messages if both exceptions are std::exception; else the job's
  ///         exception, or the caller's if the job has none.
  [[noreturn]] void fail(const std::exception_ptr& callers) {
    try {
      wait();
    } catch (const std::exception& own) {
      try {
        std::rethrow_exception(callers);
      } catch (const std::exception& fault) {
        throw Error("{}\n{}", fault.what(), own.what());
      } catch (...) {
        // The caller was only interrupted.
      }
      throw;
    }
    std::rethrow_exception(callers);
  }

 private:
  std::future<void> job_;  // of std::async: its destructor waits
};

}  // namespace groundray
