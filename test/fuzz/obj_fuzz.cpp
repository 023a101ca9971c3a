#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/model/polygon_soup.h"

// For any bytes, used both as the .obj and as the .mtl that it names, the reader returns a model or
// throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const auto soup = groundray::parse_obj(text, "fuzz.obj",
                                           [&](const std::string&) { return std::string(text); });
    groundray::ModelFaults faults;
    groundray::model_of(soup, faults);
  } catch (const groundray::Error&) {
  }
  return 0;
}
