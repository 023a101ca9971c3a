#include <cstddef>
#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/model/polygon_soup.h"
#include "test/fuzz/model_check.h"

/// For any bytes, read_stl returns a model whose indices are valid, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    check_model(
        groundray::read_stl("fuzz.stl", std::string(reinterpret_cast<const char*>(data), size)));
  } catch (const groundray::Error&) {
  }
  return 0;
}
