#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "terrain/dem/dem_file.h"
#include "terrain/erosion/erosion.h"
#include "terrain/ground.h"
#include "terrain/lod/clipmap.h"
#include "terrain/relief/relief.h"

namespace groundray {

/// Tolerances of the traced terrain, and its memory limit.
struct TerrainDetail {
  double tolerance_m = 0;    ///< vertical deviation from the reference surface permitted everywhere
  double tolerance_rad = 0;  ///< and per metre of distance from the sensors; both 0: none
  std::uint32_t memory_mib = 4096;  ///< limit for the traced surface, as in ClipmapSettings
};

/// DEM ready for tracing, with relief on request. It is kept as a whole if the surface fits into
/// memory and both tolerances are 0. Otherwise it is served by tiles, from its file if the DEM does
/// not fit. Immutable; any number of threads may use it.
class Terrain {
 public:
  /// Progress callback: receives the fraction of a long preparation that is done, 0 to 1.
  using Progress = std::function<void(double share)>;

  /// @param erosion  of the DEM, before the relief is added; of a DEM that fits into memory only.
  /// @throws Error as load_dem, DemFile, Certificate::open_or_make, eroded and Relief.
  Terrain(const std::filesystem::path& dem, const DemOptions& options, const TerrainDetail& detail,
          const Progress& progress = {}, const std::optional<ReliefSpec>& relief = {},
          const std::optional<ErosionSpec>& erosion = {});

  /// Returns the header of the DEM itself.
  const DemHeader& header() const noexcept { return loaded_.header; }
  /// Returns the reference surface: the DEM's, eroded and with relief if they are given.
  const Ground& ground() const noexcept { return loaded_.ground; }
  /// Returns the grid of its samples in D.
  const GridFrame& frame() const noexcept { return ground().frame(); }
  /// Returns the relief on the DEM, or null.
  const Relief* relief() const noexcept { return loaded_.relief.get(); }

  /// Returns a text that identifies all heights: equal texts mean equal surfaces, as far as this
  /// can be known without reading a DEM larger than memory again.
  const std::string& fingerprint() const noexcept { return loaded_.fingerprint; }

  /// Returns the surface if it is traced as a whole, at full resolution; else null.
  const HeightGrid* whole() const noexcept { return std::get_if<HeightGrid>(&loaded_.content); }

  /// Returns that surface as one level, with quads if the memory limit allows; there must be one.
  Level whole_level() const;

  /// Returns about how many bytes fast tracing of a DEM of `samples` columns and rows takes at full
  /// resolution, if the memory limit allows quads.
  static double whole_bytes(glm::ivec2 samples) noexcept;

  /// Returns the levels around the sensors, none of which is farther than `reach_m` from its
  /// frame's viewpoint. Only if whole() is null.
  /// @throws Error as Clipmap, also for a tolerance that is negative or not finite.
  Clipmap clipmap(const SensorBox& sensors, double reach_m) const;

 private:
  using Tiles = std::shared_ptr<const TileSource>;
  struct Loaded {
    DemHeader header;
    std::variant<HeightGrid, Tiles> content;
    Ground ground;
    std::string fingerprint;
    std::shared_ptr<const Relief> relief;
  };
  static Loaded load(DemFile file, const TerrainDetail& detail, const Progress& progress,
                     const std::optional<ReliefSpec>& relief,
                     const std::optional<ErosionSpec>& erosion);
  static Loaded load_dem_alone(DemFile file, const TerrainDetail& detail, const Progress& progress,
                               const Relief* relief, const std::optional<ErosionSpec>& erosion);

  TerrainDetail detail_;
  Loaded loaded_;
};

}  // namespace groundray
