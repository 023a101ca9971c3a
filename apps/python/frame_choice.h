#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/python/arrays.h"

namespace groundray::python {

/// When the frames of a sensor begin.
struct FrameTimes {
  std::string sensor;  ///< for messages
  std::int64_t count = 0;
  std::function<std::chrono::nanoseconds(std::int64_t)> begin;
};

double seconds_of(std::chrono::nanoseconds time);

/// @throws Error unless it is a time that nanoseconds can tell.
std::chrono::nanoseconds nanoseconds_of(double time_s);

AnyArray all_times_s(const FrameTimes& times);

/// Returns the frame of this number, or the one that begins then, to a microsecond.
/// @throws Error if there is none, or unless one of both is given.
std::int64_t chosen_frame(const FrameTimes& times, std::optional<double> t_s,
                          std::optional<std::int64_t> frame);

}  // namespace groundray::python
