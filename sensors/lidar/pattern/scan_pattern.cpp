#include "sensors/lidar/pattern/scan_pattern.h"

#include <cassert>
#include <cmath>

namespace groundray {
namespace {

std::chrono::nanoseconds nearest_nanosecond(double time_s) {
  return std::chrono::nanoseconds(std::llround(time_s * 1e9));
}

template <typename... Acts>
struct Overloaded : Acts... {
  using Acts::operator()...;
};
template <typename... Acts>
Overloaded(Acts...) -> Overloaded<Acts...>;

}  // namespace

ScanPattern::ScanPattern(const PatternSpec& pattern)
    : scan_(std::visit(
          Overloaded{[](const SpinningPattern& spec) -> Scan { return SpinningScan(spec); },
                     [](const LinePattern& spec) -> Scan { return LineScan(spec); },
                     [](const RisleyPattern& spec) -> Scan { return RisleyScan(spec); },
                     [](const TablePattern& spec) -> Scan { return TableScan(spec); }},
          pattern)) {}

double ScanPattern::sweep_rate_hz() const {
  return std::visit([](const auto& scan) { return scan.sweep_rate_hz(); }, scan_);
}

std::int64_t ScanPattern::pulses(std::int64_t sweep) const noexcept {
  return std::visit([&](const auto& scan) { return scan.pulses(sweep); }, scan_);
}

std::int64_t ScanPattern::neighbour_stride() const noexcept {
  return std::visit([](const auto& scan) { return scan.neighbour_stride(); }, scan_);
}

void ScanPattern::fill(std::int64_t sweep, std::int64_t begin, std::int64_t end,
                       PulseBatch& batch) const noexcept {
  assert(0 <= begin && begin <= end && end <= pulses(sweep));
  batch.reset(static_cast<std::size_t>(end - begin));
  std::visit([&](const auto& scan) { scan.fill(sweep, {begin, end}, batch); }, scan_);
}

std::chrono::nanoseconds ScanPattern::stamp(std::int64_t sweep) const noexcept {
  return nearest_nanosecond(
      std::visit([&](const auto& scan) { return scan.pulse_time_s(sweep, 0); }, scan_));
}

std::chrono::nanoseconds ScanPattern::last_firing(std::int64_t sweep) const noexcept {
  const std::int64_t last = pulses(sweep) - 1;
  return nearest_nanosecond(
      std::visit([&](const auto& scan) { return scan.pulse_time_s(sweep, last); }, scan_));
}

}  // namespace groundray
