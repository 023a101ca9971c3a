#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace groundray {

/// A share of a run's frames, the `index`-th of `count`, from 1: each frame is in one of them.
struct Shard {
  std::uint32_t index = 1;
  std::uint32_t count = 1;

  /// Whether it has a frame of a sensor that makes `frames` of them. Those of a sensor that a shard
  /// has follow each other, and no shard has two more of them than another.
  /// @param sensor  its number: where there are fewer frames than shards, each sensor begins with
  ///                another shard.
  bool has(std::uint32_t sensor, std::int64_t frame, std::int64_t frames) const noexcept;

  /// Returns how many of them it has. @param frames  may be none.
  std::int64_t share(std::uint32_t sensor, std::int64_t frames) const noexcept;

  friend auto operator<=>(const Shard&, const Shard&) = default;
};

/// Returns the shard that a text like "2/8" stands for; nothing if it is no such text, or not one
/// of 1/n to n/n.
std::optional<Shard> parse_shard(std::string_view text);

/// Returns such a text.
std::string text_of(const Shard& shard);

}  // namespace groundray
