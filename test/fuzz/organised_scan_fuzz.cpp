#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "core/error.h"
#include "reconstruction/mesh/scan/scan_mesh.h"

namespace {

// Time and memory grow with the columns: a grid of 128 rows by 32,767 takes 0.6 s with sanitizers.
constexpr int most_columns = 64;

/// Reads numbers of any type one after the other from bytes; zeros after the last byte.
class Numbers {
 public:
  explicit Numbers(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  T next() {
    T value{};
    const std::size_t size = std::min(sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return value;
  }
  bool is_empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace

/// For any returns, organise makes a scan that link accepts, or throws Error. The first byte
/// selects the columns of the returns.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Numbers numbers({data, size});
  const auto kind = numbers.next<std::uint8_t>();
  groundray::ScanReturns returns;
  while (!numbers.is_empty()) {
    const auto x = numbers.next<float>(), y = numbers.next<float>(), z = numbers.next<float>();
    returns.p_S.emplace_back(x, y, z);
    if ((kind & 1) != 0) returns.rings.push_back(numbers.next<std::int8_t>());
    if ((kind & 2) != 0) returns.columns.push_back(numbers.next<std::int16_t>() % most_columns);
    if ((kind & 4) != 0) returns.times_s.push_back(numbers.next<float>());
    if ((kind & 8) != 0) returns.origins_m.emplace_back(numbers.next<float>(), 0, 0);
    if ((kind & 16) != 0) returns.sd_m.push_back(numbers.next<float>());
    returns.intensity.push_back(numbers.next<std::uint8_t>());
  }
  const auto choice = static_cast<groundray::ReturnChoice>(kind % 3);
  const auto order =
      (kind & 32) != 0 ? groundray::RowOrder::Number : groundray::RowOrder::Elevation;
  groundray::OrganisedScan scan;
  try {
    scan = groundray::organise(returns, choice, order).scan;
  } catch (const groundray::Error&) {
    return 0;
  }
  groundray::link(scan, groundray::ScreeningLimits::ground());
  return 0;
}
