#pragma once

namespace groundray {

/// Lets GDAL open only regular files among local ones, in this process and until it ends: pipes and
/// devices beside a raster, which may never begin or end, are as if they could not be read.
void refuse_pipes_to_gdal();

}  // namespace groundray
