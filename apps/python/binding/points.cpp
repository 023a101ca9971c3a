#include "apps/python/binding/points.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nanobind/stl/pair.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

namespace groundray::python {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 19> units{{
    {"x", "m"},           {"y", "m"},
    {"z", "m"},           {"time", "s"},
    {"world_x", "m"},     {"world_y", "m"},
    {"world_z", "m"},     {"range_true", "m"},
    {"incidence", "rad"}, {"error_estimate", "m"},
    {"amplitude", "w"},   {"width", "s"},
    {"range_sd", "m"},    {"vx", "m_s"},
    {"vy", "m_s"},        {"vz", "m_s"},
    {"error_bound", "m"}, {"range", "m"},
    {"t", "s"},
}};

[[noreturn]] void throw_missing(const Points& points, const std::string& name) {
  const std::string text =
      fmt::format("there is no column '{}'; there are {}", name, fmt::join(names_of(points), ", "));
  throw nb::key_error(text.c_str());
}

// Adds a column of values of type T; returns false if the array has another type or form.
template <typename T>
bool add_column(const std::string& name, nb::handle array, PointCloud& to) {
  nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu> values;
  if (!nb::try_cast(array, values, false) || values.size() != to.rows()) return false;
  std::copy_n(values.data(), values.size(), to.add<T>(name).begin());
  return true;
}

template <typename... T>
bool add_any_column(const std::variant<PointCloud::Values<T>...>& /*types*/,
                    const std::string& name, nb::handle array, PointCloud& to) {
  return (add_column<T>(name, array, to) || ...);
}

}  // namespace

std::string name_with_unit(const std::string& column) {
  const auto* found = std::ranges::find(units, column, [](const auto& unit) { return unit.first; });
  return found == units.end() ? column : fmt::format("{}_{}", column, found->second);
}

std::vector<std::string> names_of(const Points& points) {
  std::vector<std::string> names;
  for (const PointCloud::Column& column : points.cloud.columns())
    names.push_back(name_with_unit(column.name));
  return names;
}

AnyArray column_of(const Points& points, const std::string& name, nb::handle owner) {
  for (const PointCloud::Column& column : points.cloud.columns()) {
    if (name_with_unit(column.name) != name) continue;
    return std::visit(
        [&](const auto& values) { return view(values.data(), {values.size()}, owner); },
        column.values);
  }
  throw_missing(points, name);
}

AnyArray xyz_of(const Points& points) {
  const std::vector<PointCloud::Column>& columns = points.cloud.columns();
  std::array<const PointCloud::AnyValues*, 3> axes{};
  for (const std::size_t axis : {0, 1, 2}) {
    const std::string name(1, "xyz"[axis]);
    const auto found = std::ranges::find(columns, name, &PointCloud::Column::name);
    if (found == columns.end()) throw_missing(points, name_with_unit(name));
    axes[axis] = &found->values;
  }
  const auto rows_of = [&]<typename T>(const PointCloud::Values<T>& /*of this type*/) {
    std::vector<T> rows(3 * points.cloud.rows());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::visit(
          [&](const auto& values) {
            for (std::size_t i = 0; i < values.size(); ++i) {
              const double value = values[i];  // exact, whatever the column's type
              rows[3 * i + axis] = static_cast<T>(value);
            }
          },
          *axes[axis]);
    }
    return array_of(std::move(rows), {points.cloud.rows(), 3});
  };
  const bool is_uniform =
      axes[0]->index() == axes[1]->index() && axes[0]->index() == axes[2]->index();
  return is_uniform ? std::visit(rows_of, *axes[0]) : rows_of(PointCloud::Values<double>());
}

Points selected(const Points& points, nb::handle rows) {
  const nb::object numpy = nb::module_::import_("numpy");
  const nb::object chosen = numpy.attr("arange")(points.cloud.rows())[rows];
  using Indices = nb::ndarray<const std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
  Indices indices;
  if (!nb::try_cast(chosen, indices)) {
    throw nb::type_error(
        "points[...] takes the name of a column, or selects rows by a slice, a mask or indices of "
        "one dimension; one row is points[i : i + 1]");
  }
  Points part{PointCloud(indices.size())};
  for (const PointCloud::Column& column : points.cloud.columns()) {
    std::visit(
        [&]<typename T>(const PointCloud::Values<T>& values) {
          const std::span<T> into = part.cloud.add<T>(column.name);
          for (std::size_t i = 0; i < into.size(); ++i)
            into[i] = values[static_cast<std::size_t>(indices(i))];
        },
        column.values);
  }
  return part;
}

void add_points(const Points& points, nb::handle owner, nb::list& state) {
  nb::list columns;
  for (const PointCloud::Column& column : points.cloud.columns()) {
    const AnyArray array =
        std::visit([&](const auto& values) { return view(values.data(), {values.size()}, owner); },
                   column.values);
    columns.append(nb::make_tuple(column.name, array));
  }
  state.append(points.cloud.rows());
  state.append(columns);
}

Points read_points(PickledState& state) {
  Points points{PointCloud(state.next<std::size_t>("rows"))};
  for (const nb::handle column : state.next<nb::list>("columns")) {
    std::pair<std::string, nb::object> entry;
    if (!nb::try_cast(column, entry, false)) state.refuse("columns", "has no name and array");
    const auto& [name, array] = entry;
    if (points.cloud.has(name)) state.refuse(name, "is there twice");
    if (!add_any_column(PointCloud::AnyValues(), name, array, points.cloud))
      state.refuse(name, fmt::format("must be an array of {} numbers", points.cloud.rows()));
  }
  return points;
}

}  // namespace groundray::python
