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
#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Criterion for neighbouring beams.
enum class GridSource {
  Beams,  ///< rings, and columns, times or azimuths, as for `organise`
  File,   ///< rows and columns of the file's own image
};

/// Use of semantic classes: carried along with the points, or left out.
enum class LabelUse { Carry, Leave };

/// Options for reading scan files.
struct ScanTaking {
  ScanReading columns;
  ReturnChoice returns = ReturnChoice::Last;
  GridSource grid = GridSource::Beams;
  LabelUse labels = LabelUse::Carry;
  std::optional<double> range_sd_m;  ///< replaces the values of scan and sensor
  /// Limit of memory: a file of points that needs more, and cannot be read in blocks, is rejected.
  std::size_t most_bytes = std::numeric_limits<std::size_t>::max();
};

/// Scan on the grid of its beams, in D.
struct OrganisedInput {
  OrganisedScan cells;
  std::size_t rows = 0;            ///< number of rows in the file
  std::size_t returns = 0;         ///< number of rows with a return
  OrganisedCounts counts;          ///< statistics of `organise`
  std::vector<std::string> notes;  ///< messages for the user
};

/// Points of a scan without order, in D.
struct PointInput {
  std::vector<glm::dvec3> points_m;
  std::vector<glm::dvec3> origins_m;  ///< origin of each beam
  std::vector<float> sd_m;            ///< standard deviation of each range
  std::vector<std::uint16_t> labels;  ///< one per point, or empty
  std::size_t rows = 0;               ///< number of rows read from the file
  std::chrono::nanoseconds begin{0};  ///< first firing or stamp, on the trajectory's clock
  std::chrono::nanoseconds end{0};    ///< last firing or stamp
  std::vector<std::string> notes;     ///< messages for the user
};

/// Reads a scan: the points as reported by the sensor, at the poses known to the run. Ground truth
/// in a simulated scan is never used.
/// @param scan  one of `files`.
/// @throws Error naming the file, as read_scan and organise; or if a trajectory does not cover the
///         times, or a standard deviation is negative or not finite.
OrganisedInput read_organised(const ScanFiles& files, const ScanFile& scan,
                              const ScanTaking& taking);

/// Reader for the points of a scan, as read_organised, whose beams need not form a grid. If columns
/// identify the returns of a pulse (pulse, or else ring and time, with return_index), one return
/// per pulse is taken.
///
/// Files with rows of constant size (CloudBlocks) are read in blocks. All rows are read at once if
/// points need poses at their own times or pulses have several returns.
class PointReader {
 public:
  static constexpr std::size_t usual_block_bytes = std::size_t{8} << 20U;

  /// @param files, scan  must outlive this.
  PointReader(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
              std::size_t block_bytes = usual_block_bytes);

  /// Reads the next block; returns false after the last. There is at least one block.
  /// @throws Error as read_organised; or if the file would need more than taking.most_bytes.
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
