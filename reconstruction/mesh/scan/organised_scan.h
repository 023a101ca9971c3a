#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/trajectory.h"

namespace groundray {

/// Scan whose beams lie on a grid, so that adjacent returns are neighbours in the world. Cell (row,
/// column) has index row * columns + column in each list. In any one frame.
struct OrganisedScan {
  static constexpr std::uint32_t none = 0xffffffff;

  int rows = 0, columns = 0;
  bool is_round = false;              ///< true if the last column is adjacent to the first
  std::vector<glm::dvec3> points_m;   ///< hit point of each beam; NaN without a return
  std::vector<glm::dvec3> origins_m;  ///< origin of each beam; NaN without a return
  std::vector<float> sd_m;            ///< standard deviation of each range; one per cell
  std::vector<std::uint16_t> labels;  ///< semantic class of each return, or empty
  /// Row of the source table for each cell, `none` without a return; or empty.
  std::vector<std::uint32_t> returns;
};

/// Returns of one scan in the sensor frame S at the time of each pulse, one per row. All attributes
/// except positions have one value per return, or none.
struct ScanReturns {
  std::vector<glm::dvec3> p_S;        ///< m; no return if not finite or exactly zero
  std::vector<glm::dvec3> origins_m;  ///< in S, origin of each beam; S's origin if empty
  std::vector<std::int32_t> rings;    ///< number of the beam, or of the line of an image
  std::vector<std::int32_t> columns;  ///< number of the firing, or of the column of an image
  std::vector<double> times_s;        ///< firing time of each pulse
  std::vector<float> intensity;       ///< in any unit
  std::vector<float> sd_m;            ///< standard deviation of each range; 0 if empty
  std::vector<std::uint16_t> labels;  ///< semantic classes
};

/// Return of a pulse that is used: the farthest, the one of the greatest intensity, or the nearest.
enum class ReturnChoice { Last, Strongest, First };

/// Order of the rows: by elevation of the rings that have returns, whatever their numbers; or by
/// number, with a row for each number between the smallest and the largest.
enum class RowOrder { Elevation, Number };

/// Counts of table rows that are not used.
struct OrganisedCounts {
  std::size_t no_returns = 0;     ///< rows without a return
  std::size_t other_returns = 0;  ///< of a pulse of which another return is used
  /// Returns of omitted pulses: another pulse is nearer to the centre of their cell, and the
  /// adjacent cell is not empty either.
  std::size_t crowded = 0;
};

/// Result of `organise`.
struct OrganisedReturns {
  OrganisedScan scan;
  OrganisedCounts counts;
};

/// Arranges the returns of one sweep in the cells of their beams, in S. Each ring is a row. Without
/// rings, beams are distinguished by their elevations, or by the order of the table if it contains
/// one ring after the other. Columns are given, or pulses at equal steps of time, or else of
/// azimuth. A step is the coarsest that is not rare among rings, and each ring may have its own
/// phase. If azimuth grows steadily with the columns, rings with a constant offset are shifted by
/// whole columns, so that columns represent azimuths. De-skewed points are accepted: with times or
/// columns, the azimuths of the fired beams are restored first. A pulse without a return leaves its
/// cell empty, and so does a gap in azimuth; an early or late pulse gets the adjacent cell if that
/// is empty. Takes O(n log n).
/// @throws Error if lists differ in length from the positions, data that `choice` requires are
///         missing, or returns lie on no such grid, as those of a rosette: these can be linked by
///         advance_front().
OrganisedReturns organise(const ScanReturns& returns, ReturnChoice choice = ReturnChoice::Last,
                          RowOrder order = RowOrder::Elevation);

/// Transforms a scan from S to D by a single pose.
OrganisedScan place(OrganisedScan scan, const Pose& X_DS);

/// Transforms a scan from S at the time of each pulse to D, each cell by the pose at its own time.
/// @param X_DS     path of the sensor; must cover the times.
/// @param stamp    time 0 of `times_s` on the path's clock.
/// @param times_s  of each row of the scan's source table.
/// @throws Error if the scan has no `returns`, a row has no time, or as Trajectory::pose_at.
OrganisedScan place(OrganisedScan scan, const Trajectory& X_DS, std::chrono::nanoseconds stamp,
                    std::span<const double> times_s);

/// @throws Error, beginning with `name`, listing every rule that the scan violates: lists have a
///         value per cell (labels and returns: or none), positions are within 1e15 m of zero or
///         NaN, and sd_m is not negative.
void check_scan(const OrganisedScan& scan, const char* name);

}  // namespace groundray
