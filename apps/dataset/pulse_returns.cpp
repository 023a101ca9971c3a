#include "apps/dataset/pulse_returns.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

// Keeps the elements whose indices are in `kept`, which is sorted.
template <typename T>
void keep(const std::vector<std::size_t>& kept, std::vector<T>& things) {
  for (std::size_t i = 0; i < kept.size(); ++i) things[i] = things[kept[i]];
  things.resize(kept.size());
}

bool tells_pulses(const Scan& scan) {
  const bool has_firings =
      scan.find(Quantity::Ring) != nullptr && scan.find(Quantity::Time) != nullptr;
  return has_firings || scan.find(Quantity::Pulse) != nullptr;
}

// Key of each return's pulse: equal for returns of the same pulse.
std::vector<std::array<double, 2>> pulses_of(const Scan& scan) {
  const auto* pulse = scan.find(Quantity::Pulse);
  const auto *ring = scan.find(Quantity::Ring), *time = scan.find(Quantity::Time);
  std::vector<std::array<double, 2>> keys;
  for (std::size_t i = 0; i < scan.row.size(); ++i) {
    keys.push_back(pulse != nullptr ? std::array{(*pulse)[i], 0.0}
                                    : std::array{(*ring)[i], (*time)[i]});
  }
  return keys;
}

}  // namespace

bool tells_returns(const Scan& scan) {
  return scan.find(Quantity::ReturnIndex) != nullptr && tells_pulses(scan);
}

void take_returns(ReturnChoice choice, Scan& scan) {
  const auto* index = scan.find(Quantity::ReturnIndex);
  if (index == nullptr || std::ranges::all_of(*index, [](double i) { return i == 1; })) return;
  if (!tells_pulses(scan)) {
    scan.notes.emplace_back(
        "no column identifies the returns of one pulse (pulse, or ring and time): all are used");
    return;
  }
  const auto pulses = pulses_of(scan);
  const auto* intensity = scan.find(Quantity::Intensity);
  if (choice == ReturnChoice::Strongest && intensity == nullptr)
    throw Error("{}: --returns strongest needs a column intensity", scan.name);
  const auto& ranks = choice == ReturnChoice::Strongest ? *intensity : *index;
  const double sign = choice == ReturnChoice::First ? 1 : -1;
  std::vector<std::size_t> order(scan.row.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    return std::tuple(pulses[a], sign * ranks[a], a) < std::tuple(pulses[b], sign * ranks[b], b);
  });
  const auto rest = std::ranges::unique(
      order, [&](std::size_t a, std::size_t b) { return pulses[a] == pulses[b]; });
  order.erase(rest.begin(), rest.end());
  std::ranges::sort(order);
  keep(order, scan.row);
  keep(order, scan.p_S);
  for (auto& values : scan.values) {
    if (values) keep(order, *values);
  }
}

}  // namespace groundray
