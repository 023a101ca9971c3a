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

#include "apps/view/rendering/clip_box.h"
#include "apps/view/rendering/layer.h"
#include "apps/view/rendering/pick.h"
#include "core/image/image.h"

namespace groundray {

/// Viewpoint and target of a view.
struct Look {
  glm::dvec3 from_w_m{0};
  glm::dvec3 at_w_m{0};
  glm::dvec3 up{0, 0, 1};
};

/// Text at a point, in front of everything.
struct ViewLabel {
  std::string text;
  glm::dvec3 p_w_m{0};
};

/// Returns a window that draws into memory. It needs neither display nor X server: it uses EGL
/// without a surface, and Mesa's llvmpipe if there is no graphics card.
/// @throws Error if the system has no such EGL, with the packages to install.
vtkSmartPointer<vtkRenderWindow> make_offscreen_window(glm::ivec2 size_px);

/// Returns true if the window was made by make_offscreen_window().
bool is_offscreen(vtkRenderWindow* window);

/// Layers in a render window, on or off screen. Not thread-safe.
///
/// view_impl.h has its private parts, for its sources.
class View {
 public:
  /// Constructs an empty view in `window`, which must outlive this.
  explicit View(const vtkSmartPointer<vtkRenderWindow>& window);
  ~View();
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  /// Adds a layer. A layer of the same name is replaced; the new one takes over its visibility,
  /// opacity, wireframe, point size and, if it has that column, colours. The reference stays valid
  /// until the layer is removed or replaced.
  /// @throws Error if the layer has no data, or names a column that its data lack.
  Layer& add(Layer layer);
  void remove(const std::string& name);  ///< no effect if there is none
  /// Returns the layer of that name, or null.
  const Layer* find(const std::string& name) const;
  /// Returns all layers in the order in which they were added.
  std::vector<const Layer*> layers() const;

  /// Selects the column that a layer is coloured by.
  /// @throws Error, as do all setters below, that names the missing layer or column.
  void colour_by(const std::string& layer, const std::string& column);  ///< empty: one colour
  /// Sets the range that a column's colours span, in the layer and the legend.
  void set_range(const std::string& layer, const std::string& column, glm::dvec2 range);
  void set_visible(const std::string& layer, bool visible);
  void set_opacity(const std::string& layer, double opacity);
  void set_wireframe(const std::string& layer, bool wireframe);
  void set_point_size(const std::string& layer, double size_px);

  /// Draws less detail while the view moves, to sustain the frame rate.
  void set_moving(bool moving);
  void set_legend_visible(bool visible);
  /// Darkens what lies behind its neighbours in the picture, so that clouds show their shape.
  void set_eye_dome(bool on);
  bool has_eye_dome() const;

  /// Brightens the pictures of all layers by a power of 2, in linear light.
  /// @throws Error if it is not finite.
  void set_exposure(double exposure_ev);
  double exposure_ev() const;

  /// Hides what lies outside a box, in all layers that are clipped; std::nullopt shows everything.
  /// @throws Error if the box is empty.
  void set_clip(const std::optional<ClipBox>& box);
  const std::optional<ClipBox>& clip() const;
  /// Returns the extent of everything visible except sensors and trails; std::nullopt if there is
  /// nothing.
  std::optional<ClipBox> bounds() const;
  /// Sets whether the box clips a layer.
  void set_clipped(const std::string& layer, bool clipped);
  /// Shows a text; std::nullopt for none.
  void set_label(const std::optional<ViewLabel>& label);

  /// Looks from the south and above at everything that is visible, or at one layer.
  void fit();
  void fit(const std::string& layer);
  void look(const Look& look);
  Look current_look() const;

  /// Returns the element under a pixel, counted from the window's upper left corner as in Qt: the
  /// point of a cloud nearest to it within a few pixels, unless a surface hides it; otherwise the
  /// surface.
  std::optional<Picked> pick(int x_px, int y_px) const;
  /// Returns the same but, if a corner of the picked triangle is within a few pixels, that corner.
  std::optional<Picked> pick_vertex(int x_px, int y_px) const;
  /// Returns the origin in W and the direction of a pixel's line of sight.
  std::pair<glm::dvec3, glm::dvec3> line_of_sight(int x_px, int y_px) const;

  void render();
  /// Returns the view as an RGB picture; drawn in tiles if it is larger than the window may be.
  Image8 picture(glm::ivec2 size_px);

  vtkRenderer* renderer() const;
  vtkRenderWindow* window() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray
