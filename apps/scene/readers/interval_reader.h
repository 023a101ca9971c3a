#pragma once

#include <string_view>

#include "apps/scene/yaml_reader.h"
#include "terrain/scatter/scatter.h"

// Private to this library.
namespace groundray {

inline constexpr yaml::Rule slope_rule{[](double value) { return value >= 0 && value <= 90; },
                                       "must be from 0 to 90"};

/// Reads [low, high] at a key; returns `interval` if the key is missing. Records an empty interval
/// as a fault.
Interval read_interval(yaml::Map& entry, std::string_view key, Interval interval, yaml::Rule rule,
                       yaml::Faults& faults);

}  // namespace groundray
