#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"
#include "reconstruction/mesh/scan/range_grid.h"
#include "reconstruction/mesh/scan/scan_mesh.h"

/// For any bytes, parse_range_grid returns a scan that link accepts, or throws Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  groundray::OrganisedScan scan;
  try {
    scan = groundray::parse_range_grid({reinterpret_cast<const char*>(data), size}, "fuzz.ply", {});
  } catch (const groundray::Error&) {
    return 0;
  }
  groundray::link(scan, groundray::ScreeningLimits::object());
  return 0;
}
