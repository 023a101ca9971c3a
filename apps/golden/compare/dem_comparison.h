#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/report.h"
#include "terrain/dem.h"
#include "terrain/dem_io.h"

namespace groundray::golden {

/// How two DEMs are read.
struct DemReadings {
  DemOptions reference, other;
};

/// Holds a DEM against a reference at the reference's samples, where the other's height is that of
/// its surface of two triangles a cell; of its sample, where it has one there to 1e-6 of a cell.
/// Tells vertical errors, also by slope, angles between the triangles of both on the reference's
/// grid, and holes that only one has. Says so if the other seems to be shifted. Nothing is held
/// against limits.
/// @throws Error as load_dem; if the reference systems differ (with the gdalwarp line that helps)
/// or
///         the two do not overlap. One without a reference system is taken as of the other's.
Section compare_dems(const std::filesystem::path& reference, const std::filesystem::path& other,
                     const DemReadings& readings = {});

/// As above, of DEMs in memory, whatever their reference systems. @param title  of the section.
/// @throws Error if they do not overlap.
Section compare_dems(const Dem& reference, const Dem& other, const std::string& title);

}  // namespace groundray::golden
