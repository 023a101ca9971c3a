#pragma once

#include <filesystem>
#include <string>

#include "terrain/dem/gdal_raster.h"

namespace groundray {

/// Registers GDAL's drivers. Unless the process has registered some before, only those that read
/// and write groundray's rasters remain, every VRT that GDAL opens is checked, and the file systems
/// of networks and of standard input are closed (docs/reference/trust.md).
void register_drivers();

/// Opens a raster from a file of a stranger, with one of the permitted drivers.
/// @throws Error if `name` is not a regular file, on a disk or in an archive on one; if it is in
///         none of the permitted formats or cannot be opened; if it is a VRT that check_vrt
///         rejects, or its blocks take too much memory.
GDALDatasetUniquePtr open_input(const std::string& name);

/// Checks a VRT without opening it: it and the VRTs inside it hold no bands but mosaics and warps,
/// and their sources are files that open_input may open. Their size, number and depth are limited.
/// @throws Error if it breaks a rule.
void check_vrt(const std::string& path);

/// Returns the name of the file that holds a dataset or subdataset: `GTIFF_DIR:2:a.tif` is in
/// `a.tif`.
/// @throws Error if it is not a regular file, or not local.
std::string checked_file(const std::string& name);

/// Returns the name of the permitted driver that recognises the file.
/// @throws Error if there is none.
std::string checked_driver(const std::string& name);

/// Returns why a read of a raster that follows CPLErrorReset() did not get all samples, with the
/// name of the file if it is another (a source of a VRT); empty if it did. Some drivers substitute
/// what they cannot read, report an error and return success; libjpeg only warns of files that end
/// too early.
std::string fault_of_read(CPLErr result, GDALDataset& dataset);

/// @throws Error if `bytes` exceed what the machine and the limits of the process leave.
/// @param size  size of the raster that takes them, for the message
void check_memory(const std::filesystem::path& path, glm::ivec2 size, double bytes);

}  // namespace groundray
