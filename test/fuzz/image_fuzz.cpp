#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"

/// For any bytes, the readers of pictures return one or throw Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    groundray::parse_heights(bytes, "fuzz.picture");
  } catch (const groundray::Error&) {
  }
  try {
    groundray::parse_exr(bytes, "fuzz.exr");
  } catch (const groundray::Error&) {
  }
  return 0;
}
