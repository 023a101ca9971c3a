#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/io/tum_io.h"

/// For any text, parse_tum returns a trajectory or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    groundray::parse_tum({reinterpret_cast<const char*>(data), size}, "fuzz.tum");
  } catch (const groundray::Error&) {
  }
  return 0;
}
