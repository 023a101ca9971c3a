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

/// What work tells on its way: the share that is done, 0 to 1, and of what.
using Told = std::function<void(double share, const std::string& step)>;

/// Work off the window's thread; what comes of it comes back there. One at a time: what is started
/// takes the place of what runs, which is asked to stop and not heard of again. Only for the
/// window's thread, but for what is said of `Told`.
class Job {
 public:
  /// What is called in the window's thread; any may be empty.
  struct Hooks {
    Told told{};                                       ///< now and then, while it runs
    std::function<void(const std::string&)> failed{};  ///< with the fault's message
    std::function<void()> cancelled{};                 ///< it stopped because it was asked to
    std::function<void()> ended{};                     ///< after done, failed or cancelled
  };

  Job();
  /// Asks what runs to stop, and waits for that.
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Calls `work(stop, told)` in a thread of its own and then `done` with its result in this one.
  /// `told` may be called from any thread. If `done` throws, that is a fault, too.
  template <typename Work, typename Done>
  void start(Work work, Done done, Hooks hooks) {
    run(
        [work = std::move(work), done = std::move(done)](const std::stop_token& stop,
                                                         const Told& told) -> Finish {
          using Result = decltype(work(stop, told));
          auto result = std::make_shared<Result>(work(stop, told));
          return [result, done] { done(std::move(*result)); };
        },
        std::move(hooks));
  }

  /// Asks what runs to stop; `cancelled` is called when it has.
  void cancel();
  /// Likewise, but is not heard of again: nothing runs any more, as far as this tells.
  void abandon();
  bool is_running() const noexcept { return is_running_; }

 private:
  using Finish = std::function<void()>;
  using Work = std::function<Finish(const std::stop_token&, const Told&)>;
  struct Thread {
    std::uint64_t turn = 0;
    std::jthread thread;
  };

  void run(Work work, Hooks hooks);
  Finish worked(const Work& work, const std::stop_token& stop, std::uint64_t turn);
  void post(std::function<void()> call);
  void tell(std::uint64_t turn, double share, const std::string& step);
  void end(std::uint64_t turn, const Finish& finish);

  QObject here_;  // lives in the window's thread: calls are posted to it
  Hooks hooks_;
  std::uint64_t turn_ = 0;
  bool is_running_ = false;
  std::list<Thread> threads_;
};

}  // namespace groundray
