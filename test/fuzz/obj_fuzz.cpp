#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/model/polygon_soup.h"
#include "test/fuzz/model_check.h"

/// For any bytes, used both as the .obj and as the .mtl that it names, parse_obj returns a model
/// whose indices are valid, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    check_model(groundray::parse_obj(text, "fuzz.obj",
                                     [&](const std::string&) { return std::string(text); }));
  } catch (const groundray::Error&) {
  }
  return 0;
}
