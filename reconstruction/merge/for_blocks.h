#pragma once

// Private to the library: work on many neighbours in a list, several blocks of them at once.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

namespace groundray {

/// Calls `visit(begin, end)` for each block of `in_block` numbers below `count`, several at once.
template <typename Visit>
void for_blocks(std::size_t count, std::size_t in_block, const Visit& visit) {
  tbb::parallel_for(std::size_t{0}, (count + in_block - 1) / in_block, [&](std::size_t block) {
    visit(block * in_block, std::min(count, (block + 1) * in_block));
  });
}

}  // namespace groundray
