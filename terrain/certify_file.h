#pragma once

// Private to the library: how a certificate's rasters are made.
#include <filesystem>

#include "terrain/certificate.h"
#include "terrain/certificate_files.h"
#include "terrain/dem_file.h"
#include "terrain/lattice.h"

namespace groundray {

/// Writes the rasters of the DEM's certificate into `folder`. Both passes visit square tiles of the
/// DEM in Z order, so that any raster's tiles become whole one after the other and nothing but a
/// few of them is kept in memory.
/// @throws Error if the DEM cannot be read or has no height, or the files cannot be written.
CertificateSummary certify_file(const DemFile& dem, const Lattice& lattice,
                                const std::filesystem::path& folder,
                                const Certificate::Making& making);

}  // namespace groundray
