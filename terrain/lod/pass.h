#pragma once

#include <cstddef>
#include <functional>

namespace groundray {

/// Runner of a pass: calls `work(begin, end)` for ranges that cover [0, count) once, in any order
/// and on any number of threads. The results of a pass depend on neither, because each index writes
/// only its own outputs.
using PassRunner = std::function<void(
    std::size_t count, const std::function<void(std::size_t begin, std::size_t end)>& work)>;

/// Default runner: oneTBB, on all threads.
void run_in_parallel(std::size_t count,
                     const std::function<void(std::size_t begin, std::size_t end)>& work);

/// Runs `pass(index)` for each index below `count`.
template <typename Pass>
void run_pass(const PassRunner& runner, std::size_t count, const Pass& pass) {
  runner(count, [&pass](std::size_t begin, std::size_t end) {
    for (std::size_t index = begin; index < end; ++index) pass(index);
  });
}

}  // namespace groundray
