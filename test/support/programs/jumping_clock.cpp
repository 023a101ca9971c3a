// Library for LD_PRELOAD in which the time of day jumps by ten years, back and forth, at each
// query, as when a clock is set.
#include <dlfcn.h>

#include <atomic>
#include <ctime>

extern "C" int clock_gettime(clockid_t clock, timespec* time) {
  using Query = int (*)(clockid_t, timespec*);
  static const auto query = reinterpret_cast<Query>(dlsym(RTLD_NEXT, "clock_gettime"));
  static std::atomic<unsigned> count{0};
  constexpr time_t ten_years_s = 315'576'000;
  const int result = query(clock, time);
  if (clock == CLOCK_REALTIME) time->tv_sec += ++count % 2 == 0 ? ten_years_s : -ten_years_s;
  return result;
}
