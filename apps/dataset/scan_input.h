#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/scan_files.h"
#include "apps/scan/cloud_blocks.h"
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
  /// Files of points that take more in memory, and cannot be read in blocks, are refused.
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
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
  std::chrono::nanoseconds begin{0};  ///< on the path's clock: when the first beam went
  std::chrono::nanoseconds end{0};    ///< and the last
  std::vector<std::string> notes;     ///< for people
};

/// Reads a scan: the points that the sensor reported at the poses that it knew, never what a
/// simulated scan tells of the truth.
/// @param scan  one of `files`.
/// @throws Error naming the file, as read_scan and organise; or if a path does not cover the
///         times, or a standard deviation is negative or not finite.
OrganisedInput read_organised(const ScanFiles& files, const ScanFile& scan,
                              const ScanTaking& taking);

/// Reads a scan as read_organised does, of clouds whose beams need not lie on a grid. Where columns
/// tell the returns of a pulse (pulse, or else ring and time, beside return_index), one of each is
/// taken.
///
/// Files whose rows are of one size (CloudBlocks) are read in blocks, unless points need poses at
/// times or there are several returns of a pulse: all rows are then in memory.
class PointReader {
 public:
  static constexpr std::size_t usual_block_bytes = std::size_t{8} << 20U;

  /// @param files, scan  must outlive this.
  PointReader(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
              std::size_t block_bytes = usual_block_bytes);

  /// Returns false after the last; there is one block at least.
  /// @throws Error as read_organised; or if the file would take more than taking.most_bytes.
  bool next(PointInput& block);

 private:
  void open();
  Scan next_scan();
  void check_memory() const;

  const ScanFiles& files_;
  const ScanFile& scan_;
  ScanTaking taking_;
  std::size_t block_bytes_;
  bool is_open_ = false, is_done_ = false;
  std::optional<CloudBlocks> blocks_;
  std::optional<CloudFile> ahead_;
};

/// Reads all points of a scan, as PointReader.
PointInput read_points(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking);

}  // namespace groundray
