#include "terrain/lod/pass.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace groundray {

void run_in_parallel(std::size_t count,
                     const std::function<void(std::size_t begin, std::size_t end)>& work) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, count),
      [&work](const tbb::blocked_range<std::size_t>& range) { work(range.begin(), range.end()); });
}

}  // namespace groundray
