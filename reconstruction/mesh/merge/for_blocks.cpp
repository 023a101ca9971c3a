#include "reconstruction/mesh/merge/for_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace groundray {

void for_blocks(std::size_t count, std::size_t in_block,
                const std::function<void(std::size_t begin, std::size_t end)>& visit) {
  tbb::parallel_for(std::size_t{0}, (count + in_block - 1) / in_block, [&](std::size_t block) {
    visit(block * in_block, std::min(count, (block + 1) * in_block));
  });
}

}  // namespace groundray
