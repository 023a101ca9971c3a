#include "test/support/terrain/shuffled_runner.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace groundray::testing {

PassRunner shuffled_runner(Seed seed) {
  return [seed](std::size_t count, const PassRunner::Work& work) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    // Fisher-Yates.
    for (std::size_t left = count; left > 1; --left) {
      const double share = random_uniform({seed, 0, 0, static_cast<std::uint32_t>(left)}).x;
      std::swap(order[left - 1],
                order[static_cast<std::size_t>(share * static_cast<double>(left))]);
    }
    for (const std::size_t index : order) work(index, index + 1);
  };
}

PassRunner threaded_runner(int count) {
  return [count](std::size_t size, const PassRunner::Work& work) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(count));
    tbb::task_arena arena(count);  // `count` threads, for any number of processors
    arena.execute([&] { run_in_parallel(size, work); });
  };
}

}  // namespace groundray::testing
