#pragma once

// Private to the library: computation of a certificate's rasters.
#include <filesystem>

#include "terrain/dem/dem_file.h"
#include "terrain/lod/certificate.h"
#include "terrain/lod/certificate_files.h"
#include "terrain/lod/lattice.h"

namespace groundray {

/// Writes the rasters of the DEM's certificate into `folder`. Both passes visit square tiles of the
/// DEM in Z order, so that the tiles of each raster are completed one after the other and only a
/// few of them are in memory.
/// @throws Error if the DEM cannot be read or has no height, or the files cannot be written.
CertificateSummary certify_file(const DemFile& dem, const Lattice& lattice,
                                const std::filesystem::path& folder,
                                const Certificate::Settings& settings);

}  // namespace groundray
