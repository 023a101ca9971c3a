#pragma once

#include <cstddef>
#include <functional>

namespace groundray {

/// Runs a pass: calls `work(begin, end)` for ranges that cover [0, count) once, in any order, on
/// any number of threads. A pass's result depends on neither: each index writes only outputs of its
/// own.
using PassRunner = std::function<void(
    std::size_t count, const std::function<void(std::size_t begin, std::size_t end)>& work)>;

/// The runner that programs use: oneTBB, on all threads.
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
