#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "sensors/calibration_io.h"
#include "sensors/scan_pattern.h"

namespace {

template <typename Read>
void returns_or_throws_error(const Read& read) {
  try {
    read();
  } catch (const groundray::Error&) {
  }
}

}  // namespace

// Whatever the bytes, each reader of calibrations returns what it reads or throws Error, and an
// Ouster's metadata makes a pattern.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  returns_or_throws_error(
      [&] { groundray::ScanPattern{groundray::parse_ouster_metadata(text, "fuzz.json")}; });
  returns_or_throws_error([&] { groundray::parse_velodyne_yaml(text, "fuzz.yaml"); });
  returns_or_throws_error([&] { groundray::parse_velodyne_xml(text, "fuzz.xml"); });
  returns_or_throws_error([&] { groundray::parse_hesai_csv(text, "fuzz.csv"); });
  return 0;
}
