#include "core/io/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/io/open_file.h"

namespace groundray {

double available_memory_bytes() {
  double bytes = std::numeric_limits<double>::infinity();
  std::ifstream machine = open_stream("/proc/meminfo");
  for (std::string word; machine >> word;) {
    if (word == "MemAvailable:" && machine >> bytes) bytes *= 1024;
  }
  rlimit limit{};
  double pages = 0;
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY &&
      open_stream("/proc/self/statm") >> pages) {
    const double used = pages * static_cast<double>(sysconf(_SC_PAGESIZE));
    bytes = std::min(bytes, std::max(0.0, static_cast<double>(limit.rlim_cur) - used));
  }
  return bytes;
}

void require_memory(std::string_view name, std::string_view what, double bytes) {
  constexpr double negligible_bytes = 0x1p26;  // not worth reading /proc for
  if (bytes < negligible_bytes) return;
  const double available = available_memory_bytes();
  if (bytes <= available) return;
  throw Error("{}: {} take {:.1f} GiB of memory, but {:.1f} GiB are available: use a smaller file",
              name, what, bytes / 0x1p30, available / 0x1p30);
}

}  // namespace groundray
