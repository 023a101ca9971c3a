#include "apps/python/long_call.h"

#include <nanobind/nanobind.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace groundray::python {
namespace {

namespace nb = nanobind;

// What a handler of signals raised, or null.
std::exception_ptr raised_by_signals() {
  const nb::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() == 0) return nullptr;
  try {
    nb::raise_python_error();
  } catch (...) {
    return std::current_exception();
  }
}

}  // namespace

void call_heeding_signals(const std::function<void(const StopRequest&)>& work) {
  constexpr std::chrono::milliseconds patience(50);
  StopRequest stop;
  std::exception_ptr fault;
  std::mutex mutex;
  std::condition_variable change;
  bool is_done = false;
  const auto run = [&] {
    try {
      work(stop);
    } catch (...) {
      fault = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    is_done = true;
    change.notify_one();
  };
  std::exception_ptr raised;
  {
    const nb::gil_scoped_release release;
    std::thread thread(run);
    std::unique_lock lock(mutex);
    while (!change.wait_for(lock, patience, [&] { return is_done; })) {
      if (raised) continue;
      lock.unlock();
      raised = raised_by_signals();
      if (raised) stop.make();
      lock.lock();
    }
    lock.unlock();
    thread.join();
  }
  if (raised) std::rethrow_exception(raised);
  if (fault) std::rethrow_exception(fault);
}

}  // namespace groundray::python
