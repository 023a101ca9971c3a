#pragma once

#include <string_view>

#include "sensors/yaml_reader.h"
#include "terrain/scatter.h"

// Private to this library.
namespace groundray {

inline constexpr yaml::Rule slope_rule{[](double value) { return value >= 0 && value <= 90; },
                                       "must be from 0 to 90"};

/// Reads [low, high] at a key; returns `interval` if it is not there, and notes one that is empty.
Interval read_interval(yaml::Map& entry, std::string_view key, Interval interval, yaml::Rule rule,
                       yaml::Faults& faults);

}  // namespace groundray
