#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/sampling/distribution.h"
#include "apps/scene/sampling/key_path.h"
#include "apps/scene/yaml_reader.h"
#include "core/random.h"

namespace groundray::sampling {

/// Worlds of a scene file: scenes whose values are drawn from the distributions of its block
/// `worlds` (docs/reference/sampling.md). A world depends on the file and its own number alone.
class WorldSampler {
 public:
  /// Reads the block `worlds` of a scene, and records every fault; if there is one, the sampler
  /// must not be used. Returns nullopt if the scene has no such block.
  static std::optional<WorldSampler> read(const yaml::Node& scene, yaml::Faults& faults);

  /// Returns the number of worlds; they are numbered from 0.
  std::uint32_t count() const noexcept { return count_; }

  /// Returns the keys whose values are drawn, in the order of the file; a table has one for each
  /// column.
  std::vector<std::string> keys() const;

  /// Returns the seed of a world.
  Seed seed_of(std::uint32_t world) const noexcept;

  /// Returns the drawn values of a world, one for each of keys().
  std::vector<yaml::Node> values_of(std::uint32_t world) const;

  /// Returns the scene of a world: with its seed and values, and a block `world` that states them
  /// instead of `worlds`.
  /// @throws Error with the place of `count` unless there is such a world.
  yaml::Node scene_of(std::uint32_t world) const;

 private:
  // Distribution of the values at some keys, which are drawn together.
  struct Draw {
    std::string name;  // names its random numbers
    std::vector<std::string> keys;
    Distribution distribution;
    yaml::Node at;
  };

  WorldSampler() = default;
  void read_draw(const yaml::Node& name, const yaml::Node& node, yaml::Faults& faults);
  void check_keys(const Draw& draw, yaml::Faults& faults) const;
  void check_overlaps(yaml::Faults& faults) const;
  RandomKey random_key(const std::string& name, std::uint32_t world) const noexcept;

  yaml::Node scene_;
  Seed seed_;
  std::uint32_t count_ = 0;
  std::string count_place_;  // path:line:column
  std::vector<Draw> draws_;
};

/// Reads the worlds of a scene file.
/// @throws Error if the file cannot be read, or its block `worlds` has faults or is missing.
WorldSampler load_worlds(const std::filesystem::path& path);

}  // namespace groundray::sampling
