#include "apps/python/binding/long_call.h"

#include <cxxabi.h>
#include <nanobind/nanobind.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace groundray::python {
namespace {

namespace nb = nanobind;

/// Releases the GIL during its lifetime. If Python has ended meanwhile, the GIL must not be taken
/// again: until 3.13, Python then unwinds the thread, and C++ frames that may not throw end the
/// process. Such a thread, a daemon, waits here for the process to end instead, as Python itself
/// does from 3.14 on.
class Release {
 public:
  Release() : state_(PyEval_SaveThread()) {}
  Release(const Release&) = delete;
  Release& operator=(const Release&) = delete;
  ~Release() {
    try {
      PyEval_RestoreThread(state_);
    } catch (abi::__forced_unwind&) {
      for (;;) pause();
    }
  }

 private:
  PyThreadState* state_;
};

// Returns true on the process's first thread: Python's main thread, which alone receives signals,
// unless a program embeds Python in another one.
bool is_main_thread() { return gettid() == getpid(); }

// Returns the exception that a signal handler raised, or null.
std::exception_ptr raised_by_signals() {
  const nb::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() == 0) return nullptr;
  try {
    nb::raise_python_error();
  } catch (...) {
    return std::current_exception();
  }
}

// Runs `work` on another thread while this one checks for signals.
void call_watching(const std::function<void(const StopRequest&)>& work) {
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
    const Release release;
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

}  // namespace

void call_heeding_signals(const std::function<void(const StopRequest&)>& work) {
  if (is_main_thread()) return call_watching(work);
  const Release release;
  work(StopRequest());
}

}  // namespace groundray::python
