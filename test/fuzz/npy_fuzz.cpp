#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "core/npy_reader.h"

/// Whatever the bytes, as an array and as an archive, they give numbers or an Error.
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
