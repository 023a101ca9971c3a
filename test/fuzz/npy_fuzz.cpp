#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/io/npy_io.h"

/// For any bytes, the readers of arrays and archives return numbers or throw Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    groundray::parse_npy(bytes, "fuzz.npy");
  } catch (const groundray::Error&) {
  }
  try {
    groundray::parse_npz(bytes, "fuzz.npz");
  } catch (const groundray::Error&) {
  }
  return 0;
}
