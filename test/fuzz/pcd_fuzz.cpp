#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/io/pcd_reader.h"

/// For any bytes, parse_pcd returns a cloud or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    groundray::parse_pcd({reinterpret_cast<const char*>(data), size}, "fuzz.pcd");
  } catch (const groundray::Error&) {
  }
  return 0;
}
