#include "apps/dataset/shard.h"

#include <fmt/format.h>

#include <cstddef>

#include "core/io/text_lines.h"

namespace groundray {
namespace {

constexpr std::uint32_t most_shards = 1'000'000;

}  // namespace

bool Shard::has(std::uint32_t sensor, std::int64_t frame, std::int64_t frames) const noexcept {
  if (frame < 0 || frame >= frames) return false;
  std::int64_t owner = frame * count / frames;
  if (frames < count) owner = (owner + sensor) % count;
  return owner + 1 == index;
}

// The frames with `frame * count / frames` = k start at k * frames / count, rounded up.
std::int64_t Shard::share(std::uint32_t sensor, std::int64_t frames) const noexcept {
  std::int64_t part = index - 1;
  if (frames < count) part = (part + count - sensor % count) % count;
  const auto first = [&](std::int64_t k) { return (k * frames + count - 1) / count; };
  return first(part + 1) - first(part);
}

std::optional<Shard> parse_shard(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const Shard shard{number_of<std::uint32_t>(text.substr(0, slash)).value_or(0),
                    number_of<std::uint32_t>(text.substr(slash + 1)).value_or(0)};
  if (shard.index < 1 || shard.index > shard.count || shard.count > most_shards ||
      text_of(shard) != text)
    return std::nullopt;
  return shard;
}

std::string text_of(const Shard& shard) { return fmt::format("{}/{}", shard.index, shard.count); }

}  // namespace groundray
