// Library for LD_PRELOAD with which Embree uses no more than AVX2, as on a processor without
// AVX-512.
#include <dlfcn.h>

#include <string>

extern "C" void* rtcNewDevice(const char* settings) {
  using NewDevice = void* (*)(const char*);
  static const auto new_device = reinterpret_cast<NewDevice>(dlsym(RTLD_NEXT, "rtcNewDevice"));
  const std::string given = settings == nullptr ? "" : settings;
  return new_device((given + (given.empty() ? "" : ",") + "max_isa=avx2").c_str());
}
