#pragma once

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace groundray {

enum class LayerKind { Terrain, Mesh, Cloud, Sensors, Trail, Picture };

/// Colour scales with perceptually even steps.
enum class ColourScale {
  Even,    ///< viridis: dark violet to yellow
  Vivid,   ///< turbo: many hues, to separate close values
  Signed,  ///< blue to white to red: numbers on both sides of zero
  Earth,   ///< green to brown to white: heights
};

/// Values that a layer can be coloured by: the array of that name in the layer's data.
struct LayerColumn {
  enum class Of { Points, Cells };

  std::string name;
  std::string unit;     ///< "m"; empty for none
  Of of = Of::Points;   ///< owner of the array: points or cells
  bool is_rgb = false;  ///< true for sRGB colours of three bytes, shown without a legend
  /// Values at the ends of the colours; set by colour_range() at first.
  glm::dvec2 range{0, 1};
  /// Names by number, if the column holds kinds; an empty name is displayed as its number.
  std::map<int, std::string> categories{};
  ColourScale scale = ColourScale::Even;
  bool is_ordered = false;  ///< true if the kinds are ordered: their colours follow `scale`
};

/// Displayed layer: geometry, columns of values, and appearance.
struct Layer {
  std::string name;  ///< unique in a view; slashes separate the levels of the tree: "lidar/top"
  LayerKind kind = LayerKind::Mesh;
  /// Points as floats relative to `origin_w_m`, with arrays of values. A cloud needs no cells: its
  /// points are the rows.
  vtkSmartPointer<vtkPolyData> data;
  glm::dvec3 origin_w_m{0};  ///< origin of `data` in W, to keep millimetres of map coordinates
  /// Origin, in W, of the frame in which the file states coordinates; move_frame() changes it.
  glm::dvec3 frame_w_m{0};
  std::vector<LayerColumn> columns{};
  /// Same layer with less detail, drawn while a view moves; null: created by View.
  vtkSmartPointer<vtkPolyData> coarse{};
  /// Texture, applied by the data's texture coordinates if the layer is coloured by no column or by
  /// an RGB column, which the texture shows in more detail; or null.
  vtkSmartPointer<vtkTexture> texture{};
  /// Returns `texture` at an exposure in EV: 2 to this power times as bright, in linear light;
  /// empty for textures that are no pictures of cameras.
  std::function<vtkSmartPointer<vtkTexture>(double exposure_ev)> exposed{};
  /// White texture with alpha 0 or 255, applied by the data's texture coordinates whatever the
  /// layer is coloured by: parts of alpha 0 are not drawn. Null if nothing is cut out.
  vtkSmartPointer<vtkTexture> mask{};

  std::string coloured_by{};           ///< name of a column; empty for a single colour
  glm::vec3 colour{0.8f, 0.8f, 0.8f};  ///< sRGB, used if no column is selected
  bool visible = true;
  double opacity = 1;  ///< 0 to 1
  bool wireframe = false;
  bool is_clipped = true;  ///< false: drawn outside the view's clipping box, too
  double point_size_px = 2;
  double line_width_px = 1.5;

  std::vector<std::string> facts{};  ///< text lines, such as the number of triangles and omissions

  /// Actor that is drawn; set by View::add.
  vtkSmartPointer<vtkActor> actor{};

  std::size_t points() const;     ///< number of points in `data`
  std::size_t triangles() const;  ///< number of triangles (and other polygons) in `data`

  /// Returns the column of that name, or null.
  const LayerColumn* find(const std::string& column) const;
  /// Returns the value of a column at a point or cell; NaN if there is none.
  double value(const LayerColumn& column, vtkIdType row) const;
  /// Returns a point's position in W.
  glm::dvec3 p_w_m(vtkIdType point) const;
};

/// Adds a column of floats to a layer's data and sets the column's range by colour_range().
/// @param values  one for each point or cell.
void add_column(Layer& layer, LayerColumn column, std::span<const float> values);

/// Adds a column of colours.
/// @param rgb  three sRGB bytes for each point or cell.
void add_colours(Layer& layer, LayerColumn column, std::span<const std::uint8_t> rgb);

/// Moves a layer, and its heights with it, so that its file's coordinates count from another point.
/// @param origin_w_m  in W.
/// @throws Error if it is not finite.
void move_frame(Layer& layer, const glm::dvec3& origin_w_m);

/// Returns the range that a column's colours span: all finite values, without 0.5 % at either end
/// if these extend it to more than twice the rest. A range of ColourScale::Signed that contains 0
/// is made symmetric. {0, 1} if no value is finite.
glm::dvec2 colour_range(std::span<const float> values, ColourScale scale);

/// Returns an array of VTK with a number of rows.
template <typename Array>
vtkSmartPointer<Array> make_array(const char* name, std::size_t rows, int components = 1) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(rows));
  return array;
}

/// Returns empty cells with room for a number of cells and of their corners, numbered with 32 bits:
/// VTK's default of 64 would take twice the memory.
vtkSmartPointer<vtkCellArray> make_cells(std::size_t cells, std::size_t corners);
/// Returns data with a number of points, all at (0, 0, 0).
vtkSmartPointer<vtkPolyData> make_points(std::size_t points);
/// Returns the points' coordinates, three floats each, for reading or writing.
std::span<float> coordinates(vtkPolyData& data);
/// Returns the position of a point among such coordinates.
glm::dvec3 point_at(std::span<const float> coordinates, auto point) {
  const auto first = std::size_t{3} * static_cast<std::size_t>(point);
  return {coordinates[first], coordinates[first + 1], coordinates[first + 2]};
}
/// Sets the triangles of the data.
void set_triangles(vtkPolyData& data, std::span<const glm::uvec3> triangles);
/// Sets the lines of the data: consecutive runs of points, whose lengths are `lengths`.
void set_lines(vtkPolyData& data, std::span<const std::size_t> lengths);
/// Returns the vertex indices of the triangles, three for each; the data must have no other
/// polygons.
std::span<const std::int32_t> corners(vtkPolyData& data);

}  // namespace groundray
