#pragma once

#include <filesystem>
#include <optional>

#include "apps/golden/compare/scan_pairing.h"
#include "apps/golden/report.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// What the other scan is held to; nothing is, where nothing is said.
struct ScanLimits {
  std::optional<double> range_mean_m;   ///< magnitude of the mean error of the range
  std::optional<double> range_rms_m;    ///< RMS of the errors of the range
  std::optional<double> range_p99_m;    ///< 99th percentile of their magnitudes
  std::optional<double> missing_share;  ///< of the reference's returns
  std::optional<double> extra_share;    ///< of the other's returns
};

struct ScanOptions {
  ScanReading reference, other;
  PairingOptions pairing;
  ScanLimits limits;
};

/// Holds one scan against another, as reported: x, y and z in the frame of the sensor. Tells how
/// returns were paired; errors of range (the other's less the reference's), direction and place;
/// missing and extra returns, also by range, incidence and label; how intensities go together; and
/// what looks like another unit or frame. The same files and options give the same section.
/// @throws Error as read_scan and pair_scans, or if both have returns and none could be paired.
Section compare_scans(const std::filesystem::path& reference, const std::filesystem::path& other,
                      const ScanOptions& options);

/// As above, of scans in memory; of `options`, how to read them is not used.
Section compare_scans(const Scan& reference, const Scan& other, const ScanOptions& options);

}  // namespace groundray::golden
