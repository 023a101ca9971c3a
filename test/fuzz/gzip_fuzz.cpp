#include <cstddef>
#include <cstdint>
#include <string_view>

#include "apps/dataset/packed_file.h"
#include "core/error.h"

/// For any bytes, unpack returns their contents or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    groundray::unpack({reinterpret_cast<const char*>(data), size}, "fuzz.gz");
  } catch (const groundray::Error&) {
  }
  return 0;
}
