#include "sensors/lidar/pattern/scan_pattern.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace groundray {
namespace {

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

SweepPulses ScanPattern::runs(std::int64_t sweep) const noexcept {
  return std::visit([&](const auto& scan) { return scan.runs(sweep); }, scan_);
}

std::int64_t ScanPattern::pulses(std::int64_t sweep) const noexcept {
  const auto [a, b] = runs(sweep);
  return a.end - a.begin + b.end - b.begin;
}

std::int64_t ScanPattern::neighbour_stride() const noexcept {
  return std::visit([](const auto& scan) { return scan.neighbour_stride(); }, scan_);
}

void ScanPattern::fill(std::int64_t sweep, std::int64_t begin, std::int64_t end,
                       PulseBatch& batch) const {
  assert(0 <= begin && begin <= end && end <= pulses(sweep));
  batch.reset(static_cast<std::size_t>(end - begin));
  std::visit(
      [&](const auto& scan) {
        std::int64_t before = 0;
        std::size_t row = 0;
        for (const NumberRange& run : scan.runs(sweep)) {
          const NumberRange part{run.begin + std::max<std::int64_t>(begin - before, 0),
                                 std::min(run.begin + (end - before), run.end)};
          if (part.begin < part.end) {
            scan.cycle().fill(part, batch, row);
            row += static_cast<std::size_t>(part.end - part.begin);
          }
          before += run.end - run.begin;
        }
        if constexpr (requires { scan.refract(batch); }) scan.refract(batch);
      },
      scan_);
}

std::chrono::nanoseconds ScanPattern::stamp(std::int64_t sweep) const noexcept {
  return pulse_time(sweep, 0);
}

std::chrono::nanoseconds ScanPattern::last_firing(std::int64_t sweep) const noexcept {
  return pulse_time(sweep, pulses(sweep) - 1);
}

std::chrono::nanoseconds ScanPattern::pulse_time(std::int64_t sweep,
                                                 std::int64_t pulse) const noexcept {
  const auto [a, b] = runs(sweep);
  const std::int64_t count = a.end - a.begin;
  const std::int64_t number = pulse < count ? a.begin + pulse : b.begin + pulse - count;
  const double time_s =
      std::visit([&](const auto& scan) { return scan.cycle().pulse_time_s(number); }, scan_);
  return std::chrono::nanoseconds(std::llround(time_s * 1e9));
}

}  // namespace groundray
