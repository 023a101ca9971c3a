#pragma once

#include <cstddef>
#include <functional>

// Private to the library: processes consecutive numbers in blocks, several at once.
namespace groundray {

/// Calls `visit(begin, end)` for each block of `in_block` numbers below `count`, several at once.
void for_blocks(std::size_t count, std::size_t in_block,
                const std::function<void(std::size_t begin, std::size_t end)>& visit);

}  // namespace groundray
