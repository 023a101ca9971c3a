#include "apps/scene/readers/interval_reader.h"

#include <array>

namespace groundray {

Interval read_interval(yaml::Map& entry, std::string_view key, Interval interval, yaml::Rule rule,
                       yaml::Faults& faults) {
  std::array<double, 2> ends{interval.low, interval.high};
  const yaml::Node* const at = entry.read_numbers(key, yaml::Need::Optional, ends, rule);
  if (at != nullptr && ends[0] > ends[1])
    faults.add(*at, key, "[{}, {}] is empty: are its ends swapped?", ends[0], ends[1]);
  return {ends[0], ends[1]};
}

}  // namespace groundray
