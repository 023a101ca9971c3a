#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/pose.h"
#include "core/trajectory.h"

namespace groundray {

/// A scan whose beams lie on a grid: beams beside each other there are neighbours in the world.
/// Cell (row, column) is number row * columns + column of each list. In any one frame.
struct OrganisedScan {
  static constexpr std::uint32_t none = 0xffffffff;

  int rows = 0, columns = 0;
  bool is_round = false;              ///< the last column is beside the first
  std::vector<glm::dvec3> points_m;   ///< where each beam met something; NaN where nothing returned
  std::vector<glm::dvec3> origins_m;  ///< where each beam began; NaN where nothing returned
  std::vector<float> sd_m;            ///< standard deviation of each range; one for each cell
  std::vector<std::uint16_t> labels;  ///< semantic class of each return, or none for all
  /// Of each cell, the row of the table that it was made of, `none` where nothing returned; or
  /// none for all.
  std::vector<std::uint32_t> returns;
};

/// The returns of one scan in the frame S of the sensor, a row each, as its pulse fired. What is
/// given of returns is one value for each, or none for all but the positions.
struct ScanReturns {
  std::vector<glm::dvec3> p_S;        ///< m; what is not finite or exactly zero is no return
  std::vector<glm::dvec3> origins_m;  ///< in S, where each beam began; else S's origin
  std::vector<std::int32_t> rings;    ///< number of the beam, or of the line of an image
  std::vector<std::int32_t> columns;  ///< number of the firing, or of the column of an image
  std::vector<double> times_s;        ///< when each pulse fired
  std::vector<float> intensity;       ///< in any unit
  std::vector<float> sd_m;            ///< standard deviation of each range; else 0
  std::vector<std::uint16_t> labels;  ///< semantic classes
};

/// Which return of a pulse stands for it: the farthest, that of the greatest intensity, the
/// nearest.
enum class ReturnChoice { Last, Strongest, First };

/// What order rings have: that of their elevations, whatever their numbers (of those that have
/// returns), or that of their numbers, with a row for each number between the least and greatest.
enum class RowOrder { Elevation, Number };

/// What became of the rows of a table.
struct OrganisedCounts {
  std::size_t no_returns = 0;     ///< rows that are none
  std::size_t other_returns = 0;  ///< of a pulse for which another return stands
  /// Of pulses left out: another is nearer to the centre of their cell, and the cell beside it is
  /// not empty either.
  std::size_t crowded = 0;
};

/// What `organise` made of a table.
struct OrganisedReturns {
  OrganisedScan scan;
  OrganisedCounts counts;
};

/// Puts the returns of one sweep in the cells that their beams have, in S. Each ring is a row.
/// Without rings, beams are told apart by their elevations, or by the order of the table if one
/// ring follows the other. Columns are those given, or pulses at equal steps of time or else of
/// azimuth: a step is the coarsest that is not rare among rings, and each ring may have a phase of
/// its own. Where azimuth goes on from ring to ring, columns stand for azimuths: rings that the
/// sensor turned aside are shifted by whole columns. Points may be those of a moving sensor at one
/// stamp, as if it had stood: with times or columns their azimuths are made those of the beams
/// first. A pulse without a return leaves a cell empty, and so does a gap in azimuth; one that
/// comes early or late gets the cell beside it if that is empty. Takes n log n.
/// @throws Error if lists are of other lengths than the positions, what a choice needs is not
///         given, or returns lie on no such grid, as those of a rosette: such clouds must be linked
///         as points without order.
OrganisedReturns organise(const ScanReturns& returns, ReturnChoice choice = ReturnChoice::Last,
                          RowOrder order = RowOrder::Elevation);

/// Moves a scan from S to D, all of it by one pose.
OrganisedScan place(OrganisedScan scan, const Pose& X_DS);

/// Moves a scan from S as each pulse fired to D, each cell by the pose of its own time.
/// @param X_DS     path of the sensor; must cover the times.
/// @param stamp    time 0 of `times_s` on the path's clock.
/// @param times_s  of each row of the table that the scan was made of.
/// @throws Error if the scan does not know its rows, a row has no time, or as Trajectory::pose_at.
OrganisedScan place(OrganisedScan scan, const Trajectory& X_DS, std::chrono::nanoseconds stamp,
                    std::span<const double> times_s);

/// @throws Error, with `name` at its head, naming every rule that the scan breaks: lists have a
///         value for each cell (labels and returns: or none), and sd are not negative.
void check_scan(const OrganisedScan& scan, const char* name);

}  // namespace groundray
