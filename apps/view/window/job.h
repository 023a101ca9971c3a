#pragma once

#include <QObject>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

namespace groundray {

/// Progress callback: receives the completed fraction, 0 to 1, and the name of the current step.
using JobProgress = std::function<void(double share, const std::string& step)>;

/// Work in another thread, whose result is delivered in the window's thread. One job is active at a
/// time: starting another stops the present one, whose hooks are no longer called. All functions
/// are for the window's thread only, except for calls of `JobProgress`.
class Job {
 public:
  /// Callbacks in the window's thread; any may be empty.
  struct Hooks {
    JobProgress progress{};                            ///< progress, repeatedly while it runs
    std::function<void(const std::string&)> failed{};  ///< error message
    std::function<void()> cancelled{};                 ///< the job stopped on request
    std::function<void()> ended{};                     ///< called after done, failed or cancelled
  };

  Job();
  /// Requests a stop and waits for it.
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Calls `work(stop, report)` in a new thread and then `done` with its result in the window's
  /// thread. `report` may be called from any thread. If `done` throws, the job counts as failed.
  template <typename Work, typename Done>
  void start(Work work, Done done, Hooks hooks) {
    run(
        [work = std::move(work), done = std::move(done)](const std::stop_token& stop,
                                                         const JobProgress& report) -> Finish {
          using Result = decltype(work(stop, report));
          auto result = std::make_shared<Result>(work(stop, report));
          return [result, done] { done(std::move(*result)); };
        },
        std::move(hooks));
  }

  /// Requests a stop; `cancelled` is called once the job has stopped.
  void cancel();
  /// Requests a stop and disables the job's hooks; is_running() is false at once.
  void abandon();
  bool is_running() const noexcept { return is_running_; }

 private:
  using Finish = std::function<void()>;
  using Work = std::function<Finish(const std::stop_token&, const JobProgress&)>;
  struct Thread {
    std::uint64_t turn = 0;
    std::jthread thread;
  };

  void run(Work work, Hooks hooks);
  Finish worked(const Work& work, const std::stop_token& stop, std::uint64_t turn);
  void post(std::function<void()> call);
  void show_progress(std::uint64_t turn, double share, const std::string& step);
  void end(std::uint64_t turn, const Finish& finish);

  QObject here_;  // lives in the window's thread, which receives the posted calls
  Hooks hooks_;
  std::uint64_t turn_ = 0;
  bool is_running_ = false;
  std::list<Thread> threads_;
};

}  // namespace groundray
