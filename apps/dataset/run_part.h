#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/dataset/shard.h"

namespace groundray {

/// Sensors and frames of a run that a user wants; all by default.
struct FrameChoice {
  std::vector<std::string> sensors;  ///< names, in the order of the run; empty for all
  FrameRange frames;                 ///< numbers of the frames of each sensor

  /// Returns true if it includes a sensor, which may have no frame in it.
  bool has_sensor(std::string_view name) const;
  /// Returns the number of frames that it includes of a sensor that makes `frames` of them.
  std::int64_t count(std::int64_t frames) const noexcept;
};

/// Returns the options that express a choice: "--sensor top,eye --frames 2:5"; empty for all
/// frames.
std::string text_of(const FrameChoice& choice);

/// Parses the text of `text_of`; returns nothing for any other text.
std::optional<FrameChoice> parse_choice(std::string_view text);

/// Name of a sensor of a run, and the number of its frames.
struct RunSensor {
  std::string name;
  std::int64_t frames = 0;
};

/// Returns a choice with its sensors in the order of the run, or none if it has all of them.
/// @throws Error if a sensor is unknown, or no frame is chosen.
FrameChoice checked_choice(const FrameChoice& choice, const std::vector<RunSensor>& run);

/// Part of a run that is made: a shard, or a choice; not both.
struct RunPart {
  std::optional<Shard> shard;
  FrameChoice choice;
};

}  // namespace groundray
