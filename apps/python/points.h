#pragma once

#include <string>
#include <vector>

#include "apps/python/arrays.h"
#include "core/point_cloud.h"

namespace groundray::python {

/// A table of points. Its columns have the names of docs/formats.md with their units.
struct Points {
  PointCloud cloud;
};

/// Returns the name of a file's column with its unit: "range_true_m" of "range_true".
std::string name_with_unit(const std::string& column);

std::vector<std::string> names_of(const Points& points);

/// Returns a view of a column. @throws nanobind::key_error that lists the names, if there is none.
AnyArray column_of(const Points& points, const std::string& name, nb::handle owner);

}  // namespace groundray::python
