#pragma once

#include <chrono>
#include <future>
#include <utility>

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
    if (!job_.valid()) return;
    const auto begin = std::chrono::steady_clock::now();
    job_.wait();
    waited_ += std::chrono::steady_clock::now() - begin;
    job_.get();
  }

  /// As wait, but leaves aside what the job threw.
  void settle() noexcept {
    if (job_.valid()) job_.wait();
    job_ = {};
  }

  /// How long its caller has waited so far.
  std::chrono::duration<double> waited() const noexcept { return waited_; }

 private:
  std::chrono::duration<double> waited_{0};
  std::future<void> job_;  // of std::async: its end is waited for
};

}  // namespace groundray
