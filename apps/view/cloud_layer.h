#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "apps/scan/cloud_file.h"
#include "apps/view/layer.h"

namespace groundray {

/// Points with all the numbers that a table has of them.
struct CloudContent {
  std::string name;             ///< of the layer
  std::vector<glm::dvec3> p_m;  ///< one for each row; a row without a finite one is left out
  glm::dvec3 origin_w_m{0};     ///< of the frame that these are in
  std::size_t most_points = 0;  ///< more are thinned; 0 for any number
};

/// Returns the layer of a cloud: a column for each of `table`, those of kinds with their numbers as
/// categories; x, y and z of `p_m` as "height". Where rows are left out, and the table has no such
/// column, the column "row" tells whose a point is. Numbers beyond floats are infinite, with a fact
/// that tells so.
Layer cloud_layer(const CloudContent& content, const PointCloud& table);

/// Returns which row of its table a point of a cloud's layer is of: exact, whatever columns it has.
std::size_t table_row(const Layer& cloud, vtkIdType point);

/// Returns the positions in a table by its columns x, y, z, however they are spelt; nothing if it
/// has none.
std::vector<glm::dvec3> positions_of(const PointCloud& table);

/// Returns the numbers of a column as doubles.
std::vector<double> numbers_of(const PointCloud::Column& column);

/// Adds a table's columns to a layer, a row for each of `rows`; those of positions are left out. Of
/// kinds (label, ring...) the numbers become categories; red, green and blue become "colour".
void add_table(Layer& layer, LayerColumn::Of of, const PointCloud& table,
               std::span<const std::size_t> rows);

}  // namespace groundray
