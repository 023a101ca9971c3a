#include "apps/dataset/scan_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "apps/dataset/packed_file.h"
#include "apps/dataset/pulse_returns.h"
#include "core/error.h"
#include "reconstruction/mesh/scan/range_grid.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

nanoseconds after(nanoseconds stamp, double time_s) {
  return stamp + nanoseconds(std::llround(time_s * 1e9));
}

// Pose of the sensor at each return if times are known, else at the stamp.
class SensorAt {
 public:
  /// @throws Error if points as fired have no times, or times that the trajectory does not cover.
  SensorAt(const ScanFiles& files, const ScanFile& file, const Scan& scan) : file_(file) {
    if (!file.path || scan.row.empty()) return;
    X_DS_ = &files.paths[*file.path];
    if (const auto* times_s = scan.find(Quantity::Time)) times_s_ = *times_s;
    const std::string fault = take_times();
    if (fault.empty()) return;
    if (file.points == LidarSpec::Points::AsFired)
      throw Error("{}: its points are in the sensor's moving frame (as_fired), but {}",
                  file.file.string(), fault);
    X_DS_ = nullptr;
    if (!times_s_.empty()) unused_ = fault;
  }

  /// Adds a note that states why the times of points at the stamp were not used.
  void add_note(std::vector<std::string>& notes) const {
    if (unused_.empty()) return;
    notes.push_back("the sensor's motion within scans was not used: " + unused_);
  }

  // Interval from the first beam to the last, extended to contain the stamp.
  std::pair<nanoseconds, nanoseconds> span() const {
    if (!is_path() || times_s_.empty()) return {file_.stamp, file_.stamp};
    const auto [first, last] = std::ranges::minmax(times_s_);
    return {std::min(file_.stamp, after(file_.stamp, first)),
            std::max(file_.stamp, after(file_.stamp, last))};
  }

  bool is_path() const { return X_DS_ != nullptr; }
  const Trajectory& path() const { return *X_DS_; }
  const std::vector<double>& times_s() const { return times_s_; }

  Pose pose(std::size_t i) const {
    return is_path() ? X_DS_->pose_at(after(file_.stamp, times_s_[i])) : file_.X_DS;
  }

 private:
  // Validates and clamps the times; returns a description of the fault, or an empty text.
  std::string take_times() {
    constexpr double slack_s = 1e-6;  // rounding of floats
    constexpr double most_s = 1e6;    // of one sweep: otherwise the unit or the clock is wrong
    if (times_s_.empty())
      return "they have no times (a column of unknown unit needs --time-unit-s)";
    const auto since_stamp_s = [&](nanoseconds time) {
      return 1e-9 * static_cast<double>((time - file_.stamp).count());
    };
    const double begin_s = since_stamp_s(X_DS_->begin_time());
    const double end_s = since_stamp_s(X_DS_->end_time());
    const auto [first, last] = std::ranges::minmax(times_s_);
    if (first < std::max(begin_s - slack_s, -most_s) || last > std::min(end_s + slack_s, most_s)) {
      return fmt::format(
          "the times, {:.9g} to {:.9g} s after the stamp, are not covered by the poses, {:.9g} to "
          "{:.9g} s (--time-unit-s, --time-zero-s)",
          first, last, begin_s, end_s);
    }
    for (double& time_s : times_s_) time_s = std::clamp(time_s, begin_s, end_s);
    return "";
  }

  const ScanFile& file_;
  const Trajectory* X_DS_ = nullptr;
  std::vector<double> times_s_;
  std::string unused_;
};

// Returns the points in S at each pulse's firing, undoing any de-skewing.
std::vector<glm::dvec3> as_fired(const ScanFile& file, Scan& scan, const SensorAt& sensor) {
  std::vector<glm::dvec3> p_S = std::move(scan.p_S);
  if (file.points == LidarSpec::Points::AsFired || !sensor.is_path()) return p_S;
  for (std::size_t i = 0; i < p_S.size(); ++i)
    p_S[i] = inverse(sensor.pose(i)) * (file.X_DS * p_S[i]);
  return p_S;
}

std::vector<float> sds_of(const ScanFile& file, const Scan& scan, const ScanTaking& taking) {
  const std::size_t count = scan.row.size();
  const auto* column = scan.find(Quantity::RangeSd);
  if (taking.range_sd_m || column == nullptr) {
    return std::vector<float>(
        count, static_cast<float>(taking.range_sd_m.value_or(file.range_noise_sigma_m)));
  }
  std::vector<float> sd_m;
  for (std::size_t i = 0; i < count; ++i) {
    const double value_m = (*column)[i];
    if (!(value_m >= 0) || !std::isfinite(value_m)) {
      throw Error(
          "{}: the standard deviation of range in row {}, {} m, must be finite and not negative; "
          "give one for all by --range-sd-m",
          file.file.string(), scan.row[i], value_m);
    }
    sd_m.push_back(static_cast<float>(value_m));
  }
  return sd_m;
}

// Returns a column as integers; empty if there is no such column.
template <typename T>
std::vector<T> whole(const ScanFile& file, const Scan& scan, Quantity quantity, const char* what) {
  const auto* column = scan.find(quantity);
  std::vector<T> numbers;
  if (column == nullptr) return numbers;
  for (std::size_t i = 0; i < column->size(); ++i) {
    const double value = (*column)[i];
    if (!(std::numeric_limits<T>::min() <= value && value <= std::numeric_limits<T>::max()) ||
        value != std::floor(value)) {
      throw Error("{}: the {} of row {}, {}, must be a whole number from {} to {}",
                  file.file.string(), what, scan.row[i], value, std::numeric_limits<T>::min(),
                  std::numeric_limits<T>::max());
    }
    numbers.push_back(static_cast<T>(value));
  }
  return numbers;
}

std::vector<std::uint16_t> labels_of(const ScanFile& file, const Scan& scan,
                                     const ScanTaking& taking) {
  if (taking.labels == LabelUse::Leave) return {};
  return whole<std::uint16_t>(file, scan, Quantity::Label, "label");
}

// Takes rings and columns from the file's own image.
void take_image(const ScanFile& file, const Scan& scan, ScanReturns& returns) {
  if (scan.image.columns == 0) {
    throw Error(
        "{}: --grid file needs points arranged as an image: a PCD with HEIGHT above 1, or an array "
        "of rows x columns x values",
        file.file.string());
  }
  for (const std::size_t row : scan.row) {
    returns.rings.push_back(static_cast<std::int32_t>(row / scan.image.columns));
    returns.columns.push_back(static_cast<std::int32_t>(row % scan.image.columns));
  }
}

ScanReturns returns_of(const ScanFile& file, Scan& scan, const SensorAt& sensor,
                       const ScanTaking& taking) {
  ScanReturns returns;
  returns.sd_m = sds_of(file, scan, taking);
  returns.labels = labels_of(file, scan, taking);
  if (taking.grid == GridSource::File) {
    take_image(file, scan, returns);
  } else {
    returns.rings = whole<std::int32_t>(file, scan, Quantity::Ring, "ring");
    returns.columns = whole<std::int32_t>(file, scan, Quantity::Column, "column");
  }
  if (sensor.is_path()) {
    returns.times_s = sensor.times_s();
  } else if (const auto* times_s = scan.find(Quantity::Time)) {
    returns.times_s = *times_s;
  }
  if (const auto* intensity = scan.find(Quantity::Intensity))
    returns.intensity.assign(intensity->begin(), intensity->end());
  returns.p_S = as_fired(file, scan, sensor);
  return returns;
}

// Reads a range grid, whose beams are parallel and have no times.
OrganisedInput read_grid(const ScanFile& file, const ScanTaking& taking) {
  const bool is_placed = !std::holds_alternative<Pose>(taking.columns.X_FS) ||
                         std::get<Pose>(taking.columns.X_FS) != Pose();
  if (is_placed || !taking.columns.columns.empty() || taking.grid == GridSource::File) {
    throw Error(
        "{}: --sensor-pose, --viewpoint, --columns and --grid do not apply to range grids, whose "
        "beams are known",
        file.file.string());
  }
  const auto sd_m = static_cast<float>(taking.range_sd_m.value_or(0));
  OrganisedScan grid = parse_range_grid(read_packed(file.file), file.file.string(), {.sd_m = sd_m});
  const auto is_return = [](const glm::dvec3& p) { return !std::isnan(p.x); };
  const auto returns = static_cast<std::size_t>(std::ranges::count_if(grid.points_m, is_return));
  const double unit_m = taking.columns.unit_m;
  for (std::size_t i = 0; i < grid.points_m.size(); ++i) {
    const glm::dvec3 back_m = grid.origins_m[i] - grid.points_m[i];
    grid.points_m[i] *= unit_m;
    grid.origins_m[i] = grid.points_m[i] + back_m;
  }
  return {.cells = place(std::move(grid), file.X_DS), .rows = returns, .returns = returns};
}

// Calls `organise`; its error also names the option that links points without order.
OrganisedReturns organised_returns(const ScanReturns& returns, const ScanTaking& taking) {
  const RowOrder order = taking.grid == GridSource::File ? RowOrder::Number : RowOrder::Elevation;
  try {
    return organise(returns, taking.returns, order);
  } catch (const Error& error) {
    const std::string_view what = error.what();
    if (!what.ends_with("as points without order")) throw;
    throw Error("{} (--unorganised), or select another lidar of the dataset (--sensor)", what);
  }
}

OrganisedInput organise_scan(const ScanFiles& files, const ScanFile& file,
                             const ScanTaking& taking) {
  if (file.is_range_grid) return read_grid(file, taking);
  Scan scan = read_scan(file.file, taking.columns);
  const SensorAt sensor(files, file, scan);
  OrganisedInput input{.rows = scan.rows, .returns = scan.row.size(), .notes = scan.notes};
  sensor.add_note(input.notes);
  const ScanReturns returns = returns_of(file, scan, sensor, taking);
  OrganisedReturns organised = organised_returns(returns, taking);
  input.counts = organised.counts;
  input.cells = sensor.is_path()
                    ? place(std::move(organised.scan), sensor.path(), file.stamp, sensor.times_s())
                    : place(std::move(organised.scan), file.X_DS);
  return input;
}

PointInput points_of(const OrganisedInput& grid) {
  PointInput input{.rows = grid.rows};
  for (std::size_t i = 0; i < grid.cells.points_m.size(); ++i) {
    if (std::isnan(grid.cells.points_m[i].x)) continue;
    input.points_m.push_back(grid.cells.points_m[i]);
    input.origins_m.push_back(grid.cells.origins_m[i]);
    input.sd_m.push_back(grid.cells.sd_m[i]);
  }
  return input;
}

PointInput points_of(const ScanFiles& files, const ScanFile& file, const ScanTaking& taking,
                     const Scan& scan) {
  const SensorAt sensor(files, file, scan);
  PointInput input{.sd_m = sds_of(file, scan, taking),
                   .labels = labels_of(file, scan, taking),
                   .notes = scan.notes};
  std::tie(input.begin, input.end) = sensor.span();
  sensor.add_note(input.notes);
  input.points_m.reserve(scan.p_S.size());
  input.origins_m.reserve(scan.p_S.size());
  for (std::size_t i = 0; i < scan.p_S.size(); ++i) {
    const Pose X_DS = sensor.pose(i);
    input.points_m.push_back((file.points == LidarSpec::Points::AsFired ? X_DS : file.X_DS) *
                             scan.p_S[i]);
    input.origins_m.push_back(X_DS.translation_m);
  }
  return input;
}

// Prepends the file's name to an error that does not begin with it.
template <typename Read>
auto naming(const ScanFile& file, Read&& read) {
  try {
    return read();
  } catch (const Error& error) {
    const std::string name = file.file.string();
    if (std::string_view(error.what()).starts_with(name)) throw;
    throw Error("{}: {}", name, error.what());
  }
}

}  // namespace

OrganisedInput read_organised(const ScanFiles& files, const ScanFile& file,
                              const ScanTaking& taking) {
  return naming(file, [&] { return organise_scan(files, file, taking); });
}

PointReader::PointReader(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
                         std::size_t block_bytes)
    : files_(files), scan_(scan), taking_(std::move(taking)), block_bytes_(block_bytes) {}

void PointReader::open() {
  is_open_ = true;
  std::error_code ignored;
  const bool is_large = std::filesystem::file_size(scan_.file, ignored) > block_bytes_ && !ignored;
  if (scan_.path || !is_large) return;
  blocks_ = CloudBlocks::open(scan_.file, taking_.columns.columns, block_bytes_);
  if (!blocks_) return;
  ahead_ = blocks_->next();
  const Scan first = scan_of(*ahead_, scan_.file.string(), taking_.columns);
  if (!tells_returns(first)) return;
  blocks_.reset();
  ahead_.reset();
}

// A file in memory takes its bytes, its columns, and the results made from them.
void PointReader::check_memory() const {
  constexpr std::uintmax_t times = 8;
  std::error_code fault;
  const std::uintmax_t bytes = std::filesystem::file_size(scan_.file, fault);
  if (fault || bytes <= taking_.most_bytes / times) return;
  throw Error(
      "it has {} MB, needs up to {} times that in memory, more than available or allowed by "
      "--memory-mb, and cannot be read in blocks: this is possible for .npy, .bin, binary .ply and "
      ".pcd without poses by time and without several returns per pulse; or split it",
      bytes / 1'000'000, times);
}

Scan PointReader::next_scan() {
  if (!blocks_) {
    check_memory();
    is_done_ = true;
    return read_scan(scan_.file, taking_.columns);
  }
  const CloudFile file = ahead_ ? std::move(*ahead_) : CloudFile{};
  ahead_ = blocks_->next();
  is_done_ = !ahead_;
  return scan_of(file, scan_.file.string(), taking_.columns);
}

bool PointReader::next(PointInput& block) {
  if (is_done_) return false;
  naming(scan_, [&] {
    if (!is_open_) open();
    if (scan_.is_range_grid) {
      is_done_ = true;
      block = points_of(read_grid(scan_, taking_));
      block.begin = block.end = scan_.stamp;
      return;
    }
    Scan scan = next_scan();
    const std::size_t rows = scan.rows;
    take_returns(taking_.returns, scan);
    block = points_of(files_, scan_, taking_, scan);
    block.rows = rows;
  });
  return true;
}

PointInput read_points(const ScanFiles& files, const ScanFile& file, const ScanTaking& taking) {
  constexpr std::size_t all = std::numeric_limits<std::size_t>::max();
  PointInput input;
  PointReader(files, file, taking, all).next(input);
  return input;
}

}  // namespace groundray
