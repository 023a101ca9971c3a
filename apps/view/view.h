#pragma once

#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/layer.h"
#include "core/image.h"

namespace groundray {

/// Where a view is seen from.
struct Look {
  glm::dvec3 from_w_m{0};
  glm::dvec3 at_w_m{0};
  glm::dvec3 up{0, 0, 1};
};

/// What a click met.
struct Picked {
  std::string layer;
  LayerColumn::Of of = LayerColumn::Of::Points;
  vtkIdType row = 0;  ///< the point's or cell's number in the layer's data
  glm::dvec3 p_w_m{0};
};

/// Layers in one render window: the widget's, or one off screen. Not for several threads.
class View {
 public:
  /// Draws into `window`, which outlives this.
  explicit View(const vtkSmartPointer<vtkRenderWindow>& window);
  ~View();
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  /// Shows a layer; if there is one of its name, in its stead, with what was set of that: colour,
  /// visibility, opacity. The reference stays valid till the layer is removed or replaced.
  /// @throws Error if it has no data, or a column that its data has not.
  Layer& add(Layer layer);
  void remove(const std::string& name);  ///< nothing happens if there is none
  /// Returns null if there is none.
  const Layer* find(const std::string& name) const;
  /// All, in the order in which they came.
  std::vector<const Layer*> layers() const;

  /// @throws Error, these all, naming the layer or column that is not there.
  void colour_by(const std::string& layer, const std::string& column);  ///< empty: one colour
  /// Sets what a column's colours span, here and in the legend.
  void set_range(const std::string& layer, const std::string& column, glm::dvec2 range);
  void set_visible(const std::string& layer, bool visible);
  void set_opacity(const std::string& layer, double opacity);
  void set_wireframe(const std::string& layer, bool wireframe);
  void set_point_size(const std::string& layer, double size_px);

  /// Draws less detail, so that it keeps up, until it is told that nothing moves any more.
  void set_moving(bool moving);
  void set_legend_visible(bool visible);

  /// Looks at everything that is visible, or at one layer, from the south and above.
  void fit();
  void fit(const std::string& layer);
  void look(const Look& look);
  Look current_look() const;

  /// Returns what is under a pixel, counted from the window's upper left as Qt does: the point of a
  /// cloud nearest to it within a few pixels, unless a surface hides it; else the surface.
  std::optional<Picked> pick(int x_px, int y_px) const;
  /// Returns where a pixel's line of sight begins in W, and its direction.
  std::pair<glm::dvec3, glm::dvec3> line_of_sight(int x_px, int y_px) const;

  void render();
  /// Returns RGB of the view in any size, drawn in tiles where it is larger than the window may be.
  Image8 picture(glm::ivec2 size_px);

  vtkRenderer* renderer() const;
  vtkRenderWindow* window() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray
