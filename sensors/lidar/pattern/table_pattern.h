#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "sensors/lidar/pattern/firing_cycle.h"

namespace groundray {

/// Arbitrary pattern: a table of pulses that is repeated indefinitely.
struct TablePattern {
  /// Pulse of the table.
  struct Shot {
    double time_s = 0;         ///< after the start of the table; less than the period
    double azimuth_rad = 0;    ///< from S's x axis, counter-clockwise seen from above
    double elevation_rad = 0;  ///< above the x-y plane of S
    std::uint16_t ring = 0;    ///< channel
    glm::dvec3 origin_m{0};    ///< origin of the beam, in S
  };
  double period_s = 0;
  /// Number of sweeps of equal duration into which the period is divided.
  int sweeps_per_period = 1;
  std::vector<Shot> shots;  ///< in order of time; shots of equal time fire together
};

/// Rectangular array of pixels about S's x axis, as of a solid-state lidar. Row 0 is the top,
/// column 0 the left; a pixel's ring is its row.
struct PixelArray {
  /// Spacing of the pixels, which are the centres of equal cells: in azimuth and elevation, as a
  /// mirror scans, or on a plane perpendicular to x, as a lens images.
  enum class Spacing { EqualAngles, EqualTangents };
  int rows = 1;
  int columns = 1;
  double horizontal_view_rad = 0;  ///< from the outer edge of the first cell to that of the last
  double vertical_view_rad = 0;
  Spacing spacing = Spacing::EqualAngles;
};

/// Returns a raster that fires pixel (row, column) at row * row_period_s + column * column_period_s
/// in each frame of `frame_period_s`. A column period of 0 fires all pixels of a row at once; if
/// both periods are 0, all pixels fire at once.
/// @throws Error listing every argument that is out of bounds.
TablePattern raster_pattern(const PixelArray& pixels, double row_period_s, double column_period_s,
                            double frame_period_s);

/// Reads a table in CSV: a first line `time_s,azimuth_deg,elevation_deg,channel` (columns in any
/// order; channel is optional and defaults to 0), then one pulse per line, in order of time. Blank
/// lines and lines that begin with # are ignored.
/// @throws Error with path:line and the violated rule for each bad row (the first 100).
TablePattern load_table(const std::filesystem::path& path, double period_s);

/// Parses a table like load_table, from a text in memory; `name` replaces the path in messages.
TablePattern parse_table(std::string_view text, const std::string& name, double period_s);

/// Returns the comma-separated cells of a line without blanks around them; at least one. Quotes
/// have no special meaning.
std::vector<std::string_view> cells_of(std::string_view line);

/// Pulses of a table. Sweep n consists of the pulses that fire in part n mod sweeps_per_period of a
/// period.
class TableScan {
 public:
  static constexpr int most_shots = 4'000'000;

  /// @throws Error listing every field of `pattern` that is out of bounds, or naming a sweep
  ///         without a pulse.
  explicit TableScan(const TablePattern& pattern);

  const FiringCycle& cycle() const { return cycle_; }
  double sweep_rate_hz() const { return sweeps() / cycle_.period_s(); }
  std::int64_t neighbour_stride() const { return 1; }
  SweepPulses runs(std::int64_t sweep) const noexcept {
    return {{{first_pulse(sweep), first_pulse(sweep + 1)}, {}}};
  }

 private:
  int sweeps() const { return static_cast<int>(begins_.size()); }
  std::int64_t first_pulse(std::int64_t sweep) const noexcept {
    return sweep / sweeps() * cycle_.cycle_pulses() +
           begins_[static_cast<std::size_t>(sweep % sweeps())];
  }

  FiringCycle cycle_;
  std::vector<std::int64_t> begins_;  // first shot of each sweep of a period
};

}  // namespace groundray
