#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/python/binding/arrays.h"

namespace groundray::python {

/// Start times of a sensor's frames.
struct FrameTimes {
  std::string sensor;  ///< name for messages
  std::int64_t count = 0;
  std::function<std::chrono::nanoseconds(std::int64_t)> begin;
};

double seconds_of(std::chrono::nanoseconds time);

/// Converts seconds to nanoseconds.
/// @throws Error unless the time is within 4.6e9 s of zero.
std::chrono::nanoseconds nanoseconds_of(double time_s);

AnyArray all_times_s(const FrameTimes& times);

/// Returns the frame with this number, or the one that begins at `t_s` to a microsecond.
/// @throws Error if there is no such frame, or unless exactly one of both is given.
std::int64_t chosen_frame(const FrameTimes& times, std::optional<double> t_s,
                          std::optional<std::int64_t> frame);

}  // namespace groundray::python
