#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/io/ply_io.h"

/// For any bytes, parse_ply returns a cloud or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    groundray::parse_ply({reinterpret_cast<const char*>(data), size}, "fuzz.ply");
  } catch (const groundray::Error&) {
  }
  return 0;
}
