#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace groundray {

/// Part of a run's frames, number `index` of `count`, from 1. Each frame is in exactly one part.
struct Shard {
  std::uint32_t index = 1;
  std::uint32_t count = 1;

  /// Returns true if the shard has a frame of a sensor that makes `frames` of them. A shard's
  /// frames of one sensor are consecutive; their numbers in two shards differ by one at most.
  /// @param sensor  number of the sensor: if there are fewer frames than shards, each sensor starts
  ///                with another shard.
  bool has(std::uint32_t sensor, std::int64_t frame, std::int64_t frames) const noexcept;

  /// Returns the number of a sensor's frames that the shard has.
  /// @param frames  may be 0.
  std::int64_t share(std::uint32_t sensor, std::int64_t frames) const noexcept;

  friend auto operator<=>(const Shard&, const Shard&) = default;
};

/// Parses a text like "2/8"; returns nothing for any other text, or if the index is not within 1 to
/// the count. The count is at most 1 000 000.
std::optional<Shard> parse_shard(std::string_view text);

/// Returns the text that parse_shard reads.
std::string text_of(const Shard& shard);

}  // namespace groundray
