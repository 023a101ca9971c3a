#pragma once

#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// Returns what standard deviation the ranges of a scan seem to have, metres, for scans that do not
/// say it: by how much a return is off the line through its two neighbours in the row, by the
/// median. Jumps do not count, and slopes do not; what is rougher than the spacing of beams counts
/// as noise. 0 if no three returns are beside each other.
/// @throws Error as check_scan.
double apparent_sd_m(const OrganisedScan& scan);

}  // namespace groundray
