#include "apps/scan/scan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "apps/scan/column_names.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/near_names.h"

namespace groundray {
namespace {

constexpr std::array<std::string_view, quantity_count> quantity_names{
    "intensity", "ring",      "time",  "return_index", "pulse",
    "label",     "incidence", "range", "column",       "range_sd"};

/// Values of a column as doubles.
struct Numbers {
  std::vector<double> values;
  bool are_whole = false;
  std::int64_t origin = 0;  ///< still to be added to the values
};

class Reader {
 public:
  Reader(const CloudFile& file, const ScanReading& reading, Scan& scan)
      : file_(file), reading_(reading), scan_(scan) {
    for (const auto& column : file.cloud.columns()) names_.push_back(column.name);
  }

  void read() {
    check_units();
    read_positions();
    for (std::size_t i = 0; i < quantity_count; ++i) read_quantity(static_cast<Quantity>(i));
    for (const std::string& name : names_) {
      if (std::ranges::find(used_, name) == used_.end()) scan_.unused.push_back(name);
    }
    for (const std::string& text : file_.unread) scan_.unused.push_back(text);
    drop_no_returns(sensor_from_file());
    drop_broken_keys();
  }

 private:
  void check_units() const {
    const auto is_positive = [](double value) { return value > 0 && std::isfinite(value); };
    Violations broken(scan_.name);
    broken.unless(is_positive(reading_.unit_m), "its unit, {} m, must be positive (--unit-m)",
                  reading_.unit_m);
    broken.unless(is_positive(reading_.time_unit_s.value_or(1)),
                  "its unit of time, {} s, must be positive (--time-unit-s)",
                  reading_.time_unit_s.value_or(1));
    broken.throw_if_any();
  }

  Numbers numbers_of(const std::string& name) const {
    Numbers numbers;
    const auto column = std::ranges::find(file_.cloud.columns(), name, &PointCloud::Column::name);
    const auto copy = [&numbers](const auto& values) {
      using T = typename std::decay_t<decltype(values)>::value_type;
      numbers.are_whole = std::is_integral_v<T>;
      numbers.values.assign(values.begin(), values.end());
    };
    std::visit(copy, column->values);
    for (const ColumnOrigin& origin : file_.origins) {
      if (origin.column != name) continue;
      numbers.are_whole = true;
      numbers.origin = origin.origin;
    }
    return numbers;
  }

  void read_positions() {
    std::array<Numbers, 3> xyz;
    std::vector<std::string> missing, others;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string ours(1, "xyz"[axis]);
      const auto found = find_column(names_, ours);
      if (!found) {
        missing.push_back(ours);
        continue;
      }
      xyz[static_cast<std::size_t>(axis)] = numbers_of(found->name);
      note_column(found->name, ours,
                  reading_.unit_m == 1 ? "m" : fmt::format("of {:g} m", reading_.unit_m));
    }
    for (const std::string& name : names_) {
      if (std::ranges::find(used_, name) == used_.end()) others.push_back(name);
    }
    for (std::string& name : missing) name += suggestion(name, others);
    if (!missing.empty()) {
      throw Error("{}: it has no column for {}; it has: {}", scan_.name, fmt::join(missing, ", "),
                  fmt::join(names_, ", "));
    }
    scan_.rows = file_.cloud.rows();
    for (std::size_t row = 0; row < scan_.rows; ++row) {
      scan_.p_S.emplace_back(xyz[0].values[row], xyz[1].values[row], xyz[2].values[row]);
    }
  }

  void note_column(const std::string& theirs, std::string_view ours, std::string note) {
    used_.push_back(theirs);
    scan_.read.push_back({theirs, std::string(ours), std::move(note)});
  }

  void read_quantity(Quantity quantity) {
    const std::string_view ours = quantity_names[static_cast<std::size_t>(quantity)];
    const auto found = find_column(names_, ours);
    if (!found) return;
    Numbers numbers = numbers_of(found->name);
    std::string note;
    if (quantity == Quantity::Time) {
      const auto unit_s = time_unit_of(*found, numbers);
      if (!unit_s) return;
      note = scale_time(numbers, *unit_s);
    } else if (quantity == Quantity::ReturnIndex) {
      note = count_from_one(numbers);
    } else if (quantity == Quantity::Range) {
      note = "only compared with x, y, z";
    }
    scan_.values[static_cast<std::size_t>(quantity)] = std::move(numbers.values);
    note_column(found->name, ours, std::move(note));
  }

  /// Returns the requested unit, that of the name, or seconds if the values are plausible floats.
  std::optional<double> time_unit_of(const NamedColumn& column, const Numbers& numbers) {
    if (reading_.time_unit_s) return reading_.time_unit_s;
    if (column.unit_s) return column.unit_s;
    constexpr double longest_scan_s = 600;
    const auto [low, high] = finite_limits(numbers.values);
    if (!numbers.are_whole && !(high - low > longest_scan_s)) return 1;
    scan_.notes.push_back(fmt::format(
        "The unit of column {} of {} is unknown ({}), so it was not used: give it (--time-unit-s "
        "1e-9 for nanoseconds; for the reference, --reference-time-unit-s).",
        column.name, scan_.name,
        numbers.are_whole ? "whole numbers"
                          : fmt::format("as seconds, the scan would last {:.4g} s", high - low)));
    return std::nullopt;
  }

  static std::pair<double, double> finite_limits(const std::vector<double>& values) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : values) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    return {low, high};
  }

  std::string scale_time(Numbers& numbers, double unit_s) const {
    constexpr double ns_per_s = 1e9, most_ns = 1e15;
    const auto unit_ns =
        static_cast<std::int64_t>(std::round(std::clamp(unit_s * ns_per_s, 1., most_ns)));
    const bool is_whole = std::abs(static_cast<double>(unit_ns) / ns_per_s / unit_s - 1) < 1e-12;
    // Doubles cannot represent stamps since 1970 to the nanosecond, so integers are subtracted
    // where possible.
    const std::int64_t zero_ns = reading_.time_zero.count();
    const std::int64_t taken = is_whole ? zero_ns / unit_ns : 0;
    const auto shift = static_cast<double>(  // unsigned: an extreme stamp must not overflow
        static_cast<std::int64_t>(static_cast<std::uint64_t>(numbers.origin) -
                                  static_cast<std::uint64_t>(taken)));
    const double rest_s = static_cast<double>(zero_ns - taken * unit_ns) / ns_per_s;
    for (double& value : numbers.values) value = (value + shift) * unit_s - rest_s;
    return fmt::format("of {:g} s", unit_s);
  }

  static std::string count_from_one(Numbers& numbers) {
    const auto [low, high] = finite_limits(numbers.values);
    if (low != 0) return "";
    for (double& value : numbers.values) ++value;
    return "counted from 0 there";
  }

  /// Returns true for a return; counts any other row. A non-finite range overrides the position.
  bool is_return(std::size_t row, const glm::dvec3& p) {
    NoReturns& none = scan_.no_returns;
    const auto* const ranges = scan_.find(Quantity::Range);
    const double range = ranges != nullptr ? (*ranges)[row] : 1;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto any_of = [&p](const auto& rule) { return rule(p.x) || rule(p.y) || rule(p.z); };
    const bool is_invalid =
        std::isnan(range) || any_of([](double value) { return std::isnan(value); });
    const bool is_endless = any_of([](double value) { return std::isinf(value); });
    const bool is_near = range == -infinity || p == glm::dvec3(-infinity);
    if (range == infinity || (is_endless && !is_near && !is_invalid)) {
      ++none.beyond;
    } else if (is_near) {
      ++none.near;
    } else if (is_invalid) {
      ++none.invalid;
    } else if (p == glm::dvec3(0)) {
      ++none.zero;
    } else {
      return true;
    }
    return false;
  }

  void drop_no_returns(const Pose& X_SF) {
    std::vector<glm::dvec3> kept;
    for (std::size_t row = 0; row < scan_.rows; ++row) {
      if (!is_return(row, scan_.p_S[row])) continue;
      const glm::dvec3 p_S = X_SF * (scan_.p_S[row] * reading_.unit_m);
      const double range_m = glm::length(p_S);
      constexpr double least_m = 1e-30, most_m = 1e30;  // else no valid direction or range
      if (range_m < least_m || range_m > most_m) {
        ++scan_.no_returns.invalid;
        continue;
      }
      scan_.row.push_back(row);
      kept.push_back(p_S);
    }
    scan_.p_S = std::move(kept);
    for (auto& values : scan_.values) {
      if (!values) continue;
      for (std::size_t i = 0; i < scan_.row.size(); ++i) (*values)[i] = (*values)[scan_.row[i]];
      values->resize(scan_.row.size());
    }
  }

  /// Discards keys that are not finite for every return.
  void drop_broken_keys() {
    for (const Quantity key :
         {Quantity::Ring, Quantity::Time, Quantity::ReturnIndex, Quantity::Pulse}) {
      auto& values = scan_.values[static_cast<std::size_t>(key)];
      if (!values) continue;
      const auto broken =
          std::ranges::count_if(*values, [](double v) { return !std::isfinite(v); });
      if (broken == 0) continue;
      values.reset();
      scan_.notes.push_back(
          fmt::format("In {}, {} values of {} are not finite, so the column was not used.",
                      scan_.name, broken, quantity_names[static_cast<std::size_t>(key)]));
    }
  }

  /// Returns the pose of the points' frame in the sensor's frame.
  Pose sensor_from_file() {
    Pose X_FS;
    const Pose none;
    if (std::holds_alternative<FileViewpoint>(reading_.X_FS)) {
      if (!file_.X_FS) {
        throw Error("{}: only PCD files contain a viewpoint: give the pose (--sensor-pose)",
                    scan_.name);
      }
      X_FS = *file_.X_FS;
      X_FS.translation_m *= reading_.unit_m;  // it is in the file's unit
    } else {
      X_FS = std::get<Pose>(reading_.X_FS);
      if (file_.X_FS && *file_.X_FS != none && X_FS == none) {
        scan_.notes.push_back(
            fmt::format("{} has a VIEWPOINT other than the origin, which was not used: enable it "
                        "(--viewpoint; for the reference, --reference-viewpoint) if its points are "
                        "not in the sensor's frame.",
                        scan_.name));
      }
    }
    scan_.frame = fmt::format("Points of {} are {}, x forward, y left, z up.", scan_.name,
                              X_FS == none ? "taken as in the sensor's frame"
                                           : "transformed to the sensor's frame by its pose");
    scan_.X_WS = {.rotation = X_FS.rotation,
                  .translation_m = X_FS.translation_m + reading_.origin_w_m};
    return X_FS == none ? none : inverse(X_FS);
  }

  const CloudFile& file_;
  const ScanReading& reading_;
  Scan& scan_;
  std::vector<std::string> names_, used_;
};

}  // namespace

Scan scan_of(const CloudFile& file, const std::string& name, const ScanReading& reading) {
  Scan scan;
  scan.name = name;
  scan.form = file.form;
  scan.image = file.image;
  Reader(file, reading, scan).read();
  return scan;
}

Scan read_scan(const std::filesystem::path& path, const ScanReading& reading) {
  return scan_of(read_cloud(path, reading.columns), path.string(), reading);
}

}  // namespace groundray
