#pragma once

#include "apps/golden/compare/scans/scan_errors.h"
#include "apps/golden/compare/scans/scan_pairing.h"
#include "apps/golden/report.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Adds two pictures of the errors of range and of unpaired returns: by azimuth and ring, or
/// elevation without rings, and in plan view in the W of the reference's sensor pose.
void draw_errors(const Scan& reference, const Scan& other, const Pairs& pairs,
                 const ScanErrors& errors, Section& into);

}  // namespace groundray::golden
