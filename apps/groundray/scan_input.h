#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/groundray/scan_files.h"
#include "apps/scan/scan.h"
#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// What makes beams neighbours.
enum class GridSource {
  Beams,  ///< rings, and columns, times or azimuths, as `organise` finds them
  File,   ///< the rows and columns of the file's own image
};

/// Whether semantic classes go along with the points.
enum class LabelUse { Carry, Leave };

/// How files of scans are read.
struct ScanTaking {
  ScanReading columns;
  ReturnChoice returns = ReturnChoice::Last;
  GridSource grid = GridSource::Beams;
  LabelUse labels = LabelUse::Carry;
  std::optional<double> range_sd_m;  ///< instead of what scan and sensor say
};

/// A scan on the grid of its beams, in D.
struct OrganisedInput {
  OrganisedScan cells;
  std::size_t rows = 0;            ///< of the file
  std::size_t returns = 0;         ///< among them
  OrganisedCounts counts;          ///< of the returns
  std::vector<std::string> notes;  ///< for people
};

/// Points of a scan without order, in D.
struct PointInput {
  std::vector<glm::dvec3> points_m;
  std::vector<glm::dvec3> origins_m;  ///< where each beam began
  std::vector<float> sd_m;            ///< of each range
  std::vector<std::uint16_t> labels;  ///< one for each, or none
  std::size_t rows = 0;               ///< of the file
  std::vector<std::string> notes;     ///< for people
};

/// Reads a scan: the points that the sensor reported at the poses that it knew, never what a
/// simulated scan tells of the truth.
/// @param scan  one of `files`.
/// @throws Error naming the file, as read_scan and organise; or if a path does not cover the
///         times, or a standard deviation is negative or not finite.
OrganisedInput read_organised(const ScanFiles& files, const ScanFile& scan,
                              const ScanTaking& taking);

/// As read_organised, of clouds whose beams need not lie on a grid.
PointInput read_points(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking);

}  // namespace groundray
