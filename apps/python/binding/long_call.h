#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <optional>
#include <utility>

/// Long calls from Python.
namespace groundray::python {

/// Exception of work that stops on request.
struct Stopped {};

/// Request to stop work on another thread. Thread-safe.
class StopRequest {
 public:
  void make() noexcept { is_made_ = true; }
  bool is_made() const noexcept { return is_made_; }
  /// @throws Stopped if the request has been made.
  void obey() const {
    if (is_made_) throw Stopped{};
  }

 private:
  std::atomic<bool> is_made_ = false;
};

/// Runs `work` without the GIL. If called by Python's main thread, another thread runs it while
/// this one lets Python handle signals: if a handler raises an exception, as for Ctrl-C, `work` is
/// requested to stop, and the exception is raised when it has ended. Work that never checks the
/// request runs to its end first. Python delivers no signals to other threads: they run `work` in
/// place, to its end. If Python ends before that, as is possible for daemon threads, the call never
/// returns.
/// @throws exceptions of `work`, except Stopped; nanobind::python_error.
void call_heeding_signals(const std::function<void(const StopRequest&)>& work);

/// As above, for work that returns a value.
template <typename Work>
auto without_gil(Work&& work) {
  std::optional<decltype(work(std::declval<const StopRequest&>()))> result;
  call_heeding_signals([&](const StopRequest& stop) { result.emplace(work(stop)); });
  return std::move(*result);
}

}  // namespace groundray::python
