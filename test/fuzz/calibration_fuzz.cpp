#include <cstddef>
#include <cstdint>
#include <string_view>

#include "apps/scene/calibration/calibration_io.h"
#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"

namespace {

template <typename Read>
void returns_or_throws_error(const Read& read) {
  try {
    read();
  } catch (const groundray::Error&) {
  }
}

}  // namespace

// For any bytes, each reader of calibrations returns a result or throws Error, and the metadata of
// an Ouster yield a pattern.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  returns_or_throws_error(
      [&] { groundray::ScanPattern{groundray::parse_ouster_metadata(text, "fuzz.json")}; });
  returns_or_throws_error([&] { groundray::parse_velodyne_yaml(text, "fuzz.yaml"); });
  returns_or_throws_error([&] { groundray::parse_velodyne_xml(text, "fuzz.xml"); });
  returns_or_throws_error([&] { groundray::parse_hesai_csv(text, "fuzz.csv"); });
  return 0;
}
