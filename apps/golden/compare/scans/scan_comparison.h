#pragma once

#include <filesystem>
#include <optional>

#include "apps/golden/compare/scans/scan_pairing.h"
#include "apps/golden/compare/scope.h"
#include "apps/golden/report.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Limits of the other scan's errors; figures without a limit are only reported.
struct ScanLimits {
  std::optional<double> range_mean_m;   ///< magnitude of the mean range error
  std::optional<double> range_rms_m;    ///< RMS range error
  std::optional<double> range_p99_m;    ///< 99th percentile of the magnitudes of range errors
  std::optional<double> missing_share;  ///< fraction of the reference's returns
  std::optional<double> extra_share;    ///< fraction of the other's returns
};

struct ScanOptions {
  ScanReading reference, other;
  PairingOptions pairing;
  ScanLimits limits;
  Scope scope{};  ///< its box is in the W of the reference's sensor pose, as leave_out
};

/// Compares a scan with a reference, both as reported, with x, y and z in the sensor frame. Reports
/// the pairing of returns; errors of range (other minus reference), of direction and across the
/// beam; missing and extra returns, also by range, incidence and label; the relation of
/// intensities; and signs of different units or frames. Deterministic.
/// @throws Error as check_scope, read_scan and pair_scans, or if both have returns and none could
///         be paired or the scope leaves out all pairs.
Section compare_scans(const std::filesystem::path& reference, const std::filesystem::path& other,
                      const ScanOptions& options);

/// As above, for scans in memory; the reading options are ignored.
Section compare_scans(const Scan& reference, const Scan& other, const ScanOptions& options);

}  // namespace groundray::golden
