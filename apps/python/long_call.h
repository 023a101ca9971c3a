#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <optional>
#include <utility>

/// Calls from Python that may take long.
namespace groundray::python {

/// Thrown by work that was asked to stop.
struct Stopped {};

/// Tells work on another thread to stop.
class StopRequest {
 public:
  void make() noexcept { is_made_ = true; }
  bool is_made() const noexcept { return is_made_; }
  /// @throws Stopped if it has been made.
  void obey() const {
    if (is_made_) throw Stopped{};
  }

 private:
  std::atomic<bool> is_made_ = false;
};

/// Does `work` without the GIL. Called by Python's main thread it is done by another, while this
/// one lets Python see signals: if a handler raises an exception, as Ctrl-C does, `work` is asked
/// to stop, and when it has the exception is raised. Work that never asks ends first. Python shows
/// other threads no signals: theirs is done in place, to its end. If Python ends before it, as it
/// may before daemons, the call never returns.
/// @throws What `work` does, but for Stopped; nanobind::python_error.
void call_heeding_signals(const std::function<void(const StopRequest&)>& work);

/// As above, for work that returns something.
template <typename Work>
auto without_gil(Work&& work) {
  std::optional<decltype(work(std::declval<const StopRequest&>()))> result;
  call_heeding_signals([&](const StopRequest& stop) { result.emplace(work(stop)); });
  return std::move(*result);
}

}  // namespace groundray::python
