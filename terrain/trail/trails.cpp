#include "terrain/trail/trails.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <utility>

#include "core/error.h"
#include "terrain/dem/byte_hash.h"

namespace groundray {
namespace {

template <typename T>
std::uint64_t hash_of(std::span<const T> values) {
  return byte_hash({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

}  // namespace

Trails::Trails(std::span<const TrailSpec> specs, const Trail::GroundHeight& dem,
               glm::dvec2 origin_w_m, double cell_m) {
  const auto ground = [&](glm::dvec2 p) -> std::optional<double> {
    const auto dem_m = dem(p);
    if (!dem_m) return std::nullopt;
    return height_m(p, *dem_m, 0);
  };
  for (const TrailSpec& spec : specs) {
    Trail trail(spec, ground, origin_w_m, cell_m);  // over those before it
    trails_.push_back(std::move(trail));
  }
}

const Trail& Trails::named(std::string_view name) const {
  const auto found = std::ranges::find(trails_, name, [](const Trail& t) { return t.spec().name; });
  if (found == trails_.end()) throw Error("there is no trail '{}'", name);
  return *found;
}

std::uint64_t Trails::fingerprint() const noexcept {
  std::uint64_t sum = 0;
  const auto add = [&](std::uint64_t hash) { sum = std::rotl(sum, 1) ^ hash; };
  for (const Trail& trail : trails_) {
    const TrailSpec& spec = trail.spec();
    const auto ruts = spec.ruts.value_or(TrailSpec::Ruts{0, 0, 0, 0});
    const auto washboard = spec.washboard.value_or(TrailSpec::Washboard{0, 0});
    const auto potholes = spec.potholes.value_or(TrailSpec::Potholes{0, {0, 0}, 0});
    const auto ditches = spec.ditches.value_or(TrailSpec::Ditches{0, 0});
    const auto roots = spec.roots.value_or(TrailSpec::Roots{0, 0, 0});
    const std::array numbers{spec.width_m,
                             spec.bank_slope,
                             spec.most_bank_m,
                             spec.crown_m,
                             spec.relief_share,
                             spec.variation,
                             ruts.track_m,
                             ruts.width_m,
                             ruts.depth_m,
                             ruts.berm_m,
                             washboard.wavelength_m,
                             washboard.amplitude_m,
                             potholes.per_100_m,
                             potholes.diameter_m.x,
                             potholes.diameter_m.y,
                             potholes.depth_m,
                             ditches.width_m,
                             ditches.depth_m,
                             static_cast<double>(ditches.side),
                             roots.per_100_m,
                             roots.width_m,
                             roots.height_m,
                             std::bit_cast<double>(spec.variant.value)};
    add(hash_of(std::span<const double>(numbers)));
    if (const auto& benches = spec.benches) {
      const auto blocks = benches->blocks.value_or(BenchBlocks{0, 0});
      const std::array sizes_m{benches->height_m, benches->width_m, benches->roughness_m,
                               blocks.length_m, blocks.height_m};
      add(hash_of(std::span<const double>(sizes_m)));
    }
    add(hash_of(std::span<const double>(trail.levels_m())));
    add(hash_of(std::span<const glm::dvec2>(trail.field().line().points_m)));
  }
  return sum;
}

}  // namespace groundray
