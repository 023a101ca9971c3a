#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "sensors/lidar/pattern/scan_pattern.h"

// For any text, reading it as a table yields a pattern that fills its first sweep, or an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const groundray::ScanPattern scan(
        groundray::parse_table({reinterpret_cast<const char*>(data), size}, "fuzz.csv", 0.1));
    groundray::PulseBatch batch;
    scan.fill(0, 0, scan.pulses(0), batch);
  } catch (const groundray::Error&) {
  }
  return 0;
}
