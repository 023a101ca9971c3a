#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/compare/scope.h"
#include "apps/golden/report.h"
#include "terrain/dem/dem_io.h"

namespace groundray::golden {

/// Reading options of both DEMs.
struct DemReadings {
  DemOptions reference, other;
};

/// Compares a DEM with a reference at the reference's samples. The other's height there is
/// interpolated on its surface of two triangles per cell; one of its own samples is used if it lies
/// within 1e-6 of a cell. Reports vertical errors, also by slope, angles between the triangles of
/// both on the reference's grid, and holes that only one of them has; warns if the other seems to
/// be shifted. Nothing is checked against limits. A DEM without a CRS is assumed to be in the
/// other's.
/// @param scope  its box is in W; a sample has the reference's height, or the other's in a hole of
///               the reference. Its limit of distance is that of the difference of heights.
/// @throws Error as check_scope; as load_dem, if the CRSs differ (the message shows a gdalwarp
/// command that helps),
///         or if the DEMs do not overlap, or not in the scope.
Section compare_dems(const std::filesystem::path& reference, const std::filesystem::path& other,
                     const DemReadings& readings = {}, const Scope& scope = {});

/// As above, for DEMs in memory; their CRSs are not compared.
/// @param title  title of the section.
/// @throws Error as check_scope, or if they do not overlap in the scope.
Section compare_dems(const Dem& reference, const Dem& other, const std::string& title,
                     const Scope& scope = {});

}  // namespace groundray::golden
