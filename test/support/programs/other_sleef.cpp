// Library for LD_PRELOAD with which one elementary function has another last bit for a few
// arguments, as in another version of SLEEF.
#include <dlfcn.h>

#include <cmath>

#define NAME "Sleef_finz_log1pd1_u10purecfma"

extern "C" double other_log1p(double x) asm(NAME);

double other_log1p(double x) {
  static const auto real = reinterpret_cast<double (*)(double)>(dlsym(RTLD_NEXT, NAME));
  return 0.5 < x && x < 0.51 ? std::nextafter(real(x), 0.0) : real(x);
}
