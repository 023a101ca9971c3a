#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "apps/scan/cloud_file.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Points with the columns of a table.
struct CloudContent {
  std::string name;             ///< name of the layer
  std::vector<glm::dvec3> p_m;  ///< one per row; rows without a finite position are omitted
  glm::dvec3 origin_w_m{0};     ///< origin of the frame of `p_m`, in W
  std::size_t most_points = 0;  ///< larger clouds are thinned to this number; 0 for no limit
};

/// Returns the layer of a cloud. It has a column for each column of `table` except x, y and z, and
/// "height", the z of `p_m` in W. Columns that hold kinds become categories. If rows are omitted
/// and the table has no column "row", a column of that name holds each point's row. Values beyond
/// the range of floats become infinite, which a fact of the layer reports.
Layer cloud_layer(const CloudContent& content, const PointCloud& table);

/// Returns the table row of a point of a cloud's layer. The number is exact, whatever columns the
/// layer has.
std::size_t table_row(const Layer& cloud, vtkIdType point);

/// Returns the positions in a table from its columns x, y and z under any of the names that
/// groundray reads (docs/reference/formats.md), such as x_m; empty if it lacks them.
std::vector<glm::dvec3> positions_of(const PointCloud& table);

/// Adds a table's columns to a layer, one value for each of `rows`, except x, y and z. Columns of
/// kinds (label, class...) become categories; red, green and blue become "colour" unless all values
/// are 0, which a fact reports.
void add_table(Layer& layer, LayerColumn::Of of, const PointCloud& table,
               std::span<const std::size_t> rows);

}  // namespace groundray
