#include "apps/view/window/job.h"

#include <exception>
#include <new>

#include "apps/scene/interruption.h"

namespace groundray {

Job::Job() = default;

Job::~Job() {
  cancel();
  threads_.clear();
}

void Job::run(Work work, Hooks hooks) {
  cancel();
  hooks_ = std::move(hooks);
  is_running_ = true;
  const std::uint64_t turn = ++turn_;
  threads_.push_back(
      {turn, std::jthread([this, turn, work = std::move(work)](const std::stop_token& stop) {
         Finish finish = worked(work, stop, turn);
         post([this, turn, finish = std::move(finish)] { end(turn, finish); });
       })});
}

Job::Finish Job::worked(const Work& work, const std::stop_token& stop, std::uint64_t turn) {
  const auto failure = [this](std::string message) -> Finish {
    return [this, message = std::move(message)] {
      const auto failed = hooks_.failed;  // copied, as it may start a job and so replace hooks_
      if (failed) failed(message);
    };
  };
  Finish cancelled = [this] {
    const auto hook = hooks_.cancelled;
    if (hook) hook();
  };
  try {
    Finish finish = work(stop, [this, turn](double share, const std::string& step) {
      post([this, turn, share, step] { show_progress(turn, share, step); });
    });
    if (!stop.stop_requested()) return finish;
    return cancelled;
  } catch (const Interrupted&) {
    return cancelled;
  } catch (const std::bad_alloc&) {
    return failure("there is not enough memory");
  } catch (const std::exception& error) {
    return failure(error.what());
  }
}

void Job::post(std::function<void()> call) {
  QMetaObject::invokeMethod(&here_, std::move(call), Qt::QueuedConnection);
}

void Job::show_progress(std::uint64_t turn, double share, const std::string& step) {
  if (turn == turn_ && is_running_ && hooks_.progress) hooks_.progress(share, step);
}

void Job::end(std::uint64_t turn, const Finish& finish) {
  threads_.remove_if([turn](const Thread& each) { return each.turn == turn; });
  if (turn != turn_) return;  // replaced by another job
  is_running_ = false;
  try {
    finish();
  } catch (const std::exception& error) {
    const auto failed = hooks_.failed;
    if (turn == turn_ && failed) failed(error.what());
  }
  const auto ended = hooks_.ended;
  if (turn == turn_ && ended) ended();
}

void Job::cancel() {
  for (Thread& each : threads_) each.thread.request_stop();
}

void Job::abandon() {
  cancel();
  ++turn_;
  is_running_ = false;
}

}  // namespace groundray
