#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "terrain/clipmap.h"
#include "terrain/dem_file.h"
#include "terrain/ground.h"
#include "terrain/relief.h"

namespace groundray {

/// How finely a terrain is traced, and what that may cost.
struct TerrainDetail {
  double tolerance_m = 0;    ///< vertical deviation from the reference surface allowed everywhere
  double tolerance_rad = 0;  ///< and for each metre of distance from the sensors; both 0: none
  std::uint32_t memory_mib = 4096;  ///< for the surface that is traced, as in ClipmapSettings
};

/// A DEM ready for tracing, with relief on it if asked for: in memory as a whole if the surface
/// fits there, else served by tiles, from its file if the DEM does not fit. Immutable; any number
/// of threads may use it.
class Terrain {
 public:
  /// Is told now and then which share of a long preparation is done, 0 to 1.
  using Progress = std::function<void(double share)>;

  /// @throws Error as load_dem, DemFile, Certificate::open_or_make and Relief, and for a detail
  /// that
  ///         is negative or not finite.
  Terrain(const std::filesystem::path& dem, const DemOptions& options, const TerrainDetail& detail,
          const Progress& progress = {}, const std::optional<ReliefSpec>& relief = {});

  /// Of the DEM itself.
  const DemHeader& header() const noexcept { return header_; }
  /// The reference surface: the DEM's, or that with relief.
  const Ground& ground() const noexcept { return ground_; }
  /// Where its samples stand in D.
  const GridFrame& frame() const noexcept { return ground_.frame(); }
  /// What lies on the DEM, or null.
  const Relief* relief() const noexcept { return relief_.get(); }

  /// Stands for all heights: equal texts mean equal surfaces, as far as that can be told without
  /// reading a DEM larger than memory again.
  const std::string& fingerprint() const noexcept { return fingerprint_; }

  /// The surface if it is traced as it is, at full resolution; else null.
  const HeightGrid* whole() const noexcept { return std::get_if<HeightGrid>(&content_); }

  /// Bytes that tracing a DEM of so many columns and rows takes at full resolution, about.
  static double whole_bytes(glm::ivec2 samples) noexcept;

  /// Returns the levels round sensors, none of which is farther than `reach_m` from its frame's
  /// viewpoint. Only if whole() is null.
  Clipmap clipmap(const SensorBox& sensors, double reach_m) const;

 private:
  using Tiles = std::shared_ptr<const TileSource>;
  struct Loaded;

  Terrain(Loaded loaded, const TerrainDetail& detail);
  static Loaded load(const std::filesystem::path& path, const DemOptions& options,
                     const TerrainDetail& detail, const Progress& progress,
                     const std::optional<ReliefSpec>& relief);
  static Loaded load_dem_alone(const std::filesystem::path& path, const DemOptions& options,
                               const TerrainDetail& detail, const Progress& progress,
                               const Relief* relief);

  DemHeader header_;
  TerrainDetail detail_;
  std::variant<HeightGrid, Tiles> content_;
  Ground ground_;
  std::string fingerprint_;
  std::shared_ptr<const Relief> relief_;
};

}  // namespace groundray
