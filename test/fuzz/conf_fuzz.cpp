#include <cstddef>
#include <cstdint>
#include <string_view>

#include "apps/dataset/range_conf.h"
#include "core/error.h"

/// For any text, parse_conf returns poses or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    groundray::parse_conf({reinterpret_cast<const char*>(data), size}, "fuzz.conf");
  } catch (const groundray::Error&) {
  }
  return 0;
}
