// Library for LD_PRELOAD with which Embree uses no more than AVX2, as on a processor without
// AVX-512; it says so on standard error.
#include <dlfcn.h>

#include <cstdio>
#include <string>

#include "core/tracing/embree_adapter.h"

RTCDevice rtcNewDevice(const char* settings) {
  using NewDevice = RTCDevice (*)(const char*);
  static const auto new_device = reinterpret_cast<NewDevice>(dlsym(RTLD_NEXT, "rtcNewDevice"));
  const std::string given = settings == nullptr ? "" : settings;
  const auto device = new_device((given + (given.empty() ? "" : ",") + "max_isa=avx2").c_str());
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) == 0)
    std::fputs("Embree without AVX-512\n", stderr);
  return device;
}
