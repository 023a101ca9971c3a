// In place of terrain/lod/pass.cpp, which needs oneTBB.
#include <algorithm>
#include <atomic>
#include <barrier>
#include <cstddef>
#include <thread>
#include <vector>

#include "terrain/lod/pass.h"
#include "test/device/host_arrays.h"

namespace groundray {

namespace {

// Threads that wait for work, one for each of the processor's with the one that calls.
class ThreadPool {
 public:
  ThreadPool() {
    const testing::HostArrays::Use elsewhere(nullptr);  // it outlives all arrays
    for (std::ptrdiff_t i = 1; i < threads_; ++i) others_.emplace_back([this] { work_on(); });
  }
  ~ThreadPool() {
    work_ = nullptr;
    begin_.arrive_and_wait();
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  void run(std::size_t count, const PassRunner::Work& work) {
    constexpr std::size_t parts_of_a_thread = 8;
    count_ = count;
    part_ = std::max<std::size_t>(1, count / (parts_of_a_thread * std::size_t(threads_)));
    next_ = 0;
    work_ = &work;
    begin_.arrive_and_wait();
    run_parts();
    end_.arrive_and_wait();
  }

 private:
  void run_parts() {
    for (std::size_t begin; (begin = next_.fetch_add(part_)) < count_;)
      (*work_)(begin, std::min(begin + part_, count_));
  }
  void work_on() {
    for (begin_.arrive_and_wait(); work_ != nullptr; begin_.arrive_and_wait()) {
      run_parts();
      end_.arrive_and_wait();
    }
  }

  std::ptrdiff_t threads_ = std::max(1u, std::thread::hardware_concurrency());
  std::barrier<> begin_{threads_}, end_{threads_};
  std::size_t count_ = 0, part_ = 1;
  std::atomic<std::size_t> next_ = 0;
  const PassRunner::Work* work_ = nullptr;
  std::vector<std::jthread> others_;  // last, for they use the rest
};

}  // namespace

void run_in_parallel(std::size_t count,
                     const std::function<void(std::size_t begin, std::size_t end)>& work) {
  static ThreadPool pool;
  if (count > 1)
    pool.run(count, work);
  else
    work(0, count);
}

}  // namespace groundray
