#pragma once

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkTexture.h>

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace groundray {

enum class LayerKind { Terrain, Mesh, Cloud, Sensors, Trail, Picture };

/// Colours for numbers, each of even steps for the eye.
enum class ColourScale {
  Even,    ///< viridis: dark violet to yellow
  Vivid,   ///< turbo: many hues, for what lies close together
  Signed,  ///< blue to white to red: numbers on both sides of zero
  Earth,   ///< green to brown to white: heights
};

/// Numbers of a layer that it can be coloured by: an array of its data by that name.
struct LayerColumn {
  enum class Of { Points, Cells };

  std::string name;
  std::string unit;     ///< "m"; empty for none
  Of of = Of::Points;   ///< whose data the array is of
  bool is_rgb = false;  ///< three bytes that are a colour themselves, sRGB: no legend
  /// What is told apart by colour: from the least finite value to the greatest, but for a few far
  /// out.
  glm::dvec2 range{0, 1};
  /// If it counts kinds: their names by number; of a number without name, the number stands.
  std::map<int, std::string> categories{};
  ColourScale scale = ColourScale::Even;
  bool is_ordered = false;  ///< kinds follow each other: their colours are those of the scale
};

/// One thing that a view shows.
struct Layer {
  std::string name;  ///< unique in a view; parts of it by slashes: "lidar/top"
  LayerKind kind = LayerKind::Mesh;
  /// Points in floats from `origin_w_m`, and with them arrays of numbers. Clouds are their points,
  /// row by row; they need no cells.
  vtkSmartPointer<vtkPolyData> data;
  glm::dvec3 origin_w_m{0};  ///< in W, so that coordinates of a map keep their millimetres
  std::vector<LayerColumn> columns{};
  /// The same with less detail, for the time while a view moves; null: View makes it.
  vtkSmartPointer<vtkPolyData> coarse{};
  /// Lies on the surface by the data's texture coordinates, where no column colours it, or one that
  /// is a colour: that is then what the texture shows more finely. Or null.
  vtkSmartPointer<vtkTexture> texture{};

  std::string coloured_by{};           ///< a column; empty for one colour
  glm::vec3 colour{0.8f, 0.8f, 0.8f};  ///< sRGB, where no column colours it
  bool visible = true;
  double opacity = 1;  ///< 0 to 1
  bool wireframe = false;
  double point_size_px = 2;
  double line_width_px = 1.5;

  std::vector<std::string> facts{};  ///< lines for people: how many triangles, what was left out

  /// What is drawn; View makes it as it takes the layer.
  vtkSmartPointer<vtkActor> actor{};

  std::size_t points() const;     ///< of its data
  std::size_t triangles() const;  ///< of its data, and polygons

  /// Returns the column of that name, or null.
  const LayerColumn* find(const std::string& column) const;
  /// Returns the value of a column at a point or cell, NaN if there is none.
  double value(const LayerColumn& column, vtkIdType row) const;
  /// Returns a point's place in W.
  glm::dvec3 p_w_m(vtkIdType point) const;
};

/// Adds a column of floats to a layer's data, its range told by the numbers: NaN counts nowhere.
/// @param values  one for each point or cell.
void add_column(Layer& layer, LayerColumn column, std::span<const float> values);

/// Adds a column of colours.
/// @param rgb  three bytes for each point or cell.
void add_colours(Layer& layer, LayerColumn column, std::span<const std::uint8_t> rgb);

/// Returns what a column's colours span: all finite numbers, but for a few in 200 on either side
/// where those stretch it more than twofold; a range on both sides of zero is made symmetric for
/// signed numbers.
glm::dvec2 colour_range(std::span<const float> values, ColourScale scale);

/// Returns data of so many points, at (0, 0, 0) as yet.
vtkSmartPointer<vtkPolyData> make_points(std::size_t points);
/// Returns the points' coordinates, three floats each, to be filled.
std::span<float> coordinates(vtkPolyData& data);
/// Gives data its triangles.
void set_triangles(vtkPolyData& data, std::span<const glm::uvec3> triangles);
/// Gives data lines: runs of points, each as long as `lengths` says, one after the other.
void set_lines(vtkPolyData& data, std::span<const std::size_t> lengths);
/// Returns the corners of the triangles of data that has no other polygons, three for each.
std::span<const std::int32_t> corners(vtkPolyData& data);

}  // namespace groundray
