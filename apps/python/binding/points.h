#pragma once

#include <string>
#include <vector>

#include "apps/python/binding/arrays.h"
#include "apps/python/binding/pickle.h"
#include "core/io/point_cloud.h"

namespace groundray::python {

/// Table of points. The names of its columns are those of docs/reference/formats.md with their
/// units.
struct Points {
  PointCloud cloud;
};

/// Returns the name of a file's column with its unit: "range_true_m" of "range_true".
std::string name_with_unit(const std::string& column);

std::vector<std::string> names_of(const Points& points);

/// Returns a view of a column.
/// @throws nanobind::key_error that lists the names, if there is no such column.
AnyArray column_of(const Points& points, const std::string& name, nb::handle owner);

/// Returns the columns x, y, z as rows of three values, a copy: of their type, or of doubles if
/// they differ.
/// @throws nanobind::key_error if they are not there.
AnyArray xyz_of(const Points& points);

/// Returns rows as a table of their own.
/// @param rows  what selects elements of a NumPy array of one dimension: a slice, a mask, indices.
/// @throws IndexError of NumPy, or nanobind::type_error if that selects no array of rows.
Points selected(const Points& points, nb::handle rows);

/// Adds the two values of a table to the state of an object that `owner` keeps alive, and reads
/// them.
/// @throws Error naming the damaged column.
void add_points(const Points& points, nb::handle owner, nb::list& state);
Points read_points(PickledState& state);

}  // namespace groundray::python
