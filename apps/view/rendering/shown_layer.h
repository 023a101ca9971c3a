#pragma once

#include <vtkPlaneCollection.h>
#include <vtkPolyDataMapper.h>
#include <vtkSmartPointer.h>

#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>

#include "apps/view/rendering/clip_box.h"
#include "apps/view/rendering/layer.h"

namespace groundray {

/// Layer of a View as it is drawn: in full or, while the view moves, with less detail.
class ShownLayer {
 public:
  /// @param origin_w_m  origin of the view, in W.
  /// @throws Error as View::add.
  ShownLayer(Layer layer, const glm::dvec3& origin_w_m);

  const Layer& layer() const noexcept { return layer_; }
  /// Returns the layer for changes; call restyle() to display them.
  Layer& layer() noexcept { return layer_; }
  /// Applies the layer's colours, opacity and other settings.
  void restyle();

  /// Hides what lies outside a box, unless the layer is not clipped; std::nullopt hides nothing.
  void clip(const std::optional<ClipBox>& box);

  /// Reduces the drawn layer to about `elements` points or triangles.
  void thin_to(std::size_t elements);
  void draw_full();
  /// Returns the number of points of a cloud, or else of triangles.
  std::size_t elements() const;

 private:
  void paint(vtkPolyDataMapper& mapper) const;
  void draw(vtkPolyDataMapper* mapper);
  bool is_textured(vtkPolyDataMapper& mapper) const;
  bool is_cut(vtkPolyDataMapper& mapper) const;

  Layer layer_;
  glm::dvec3 view_origin_w_m_;
  vtkSmartPointer<vtkPlaneCollection> planes_;  // null: not clipped
  vtkSmartPointer<vtkPolyDataMapper> full_, thin_;
  std::size_t thinned_to_ = 0;
};

}  // namespace groundray
