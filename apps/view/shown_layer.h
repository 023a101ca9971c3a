#pragma once

#include <vtkPolyDataMapper.h>
#include <vtkSmartPointer.h>

#include <cstddef>
#include <glm/vec3.hpp>

#include "apps/view/layer.h"

namespace groundray {

/// A layer as it is drawn: in full, and with less detail while a view moves. One of a View.
class ShownLayer {
 public:
  /// @param origin_w_m  of the view. @throws Error as View::add.
  ShownLayer(Layer layer, const glm::dvec3& origin_w_m);

  const Layer& layer() const noexcept { return layer_; }
  /// To be changed; restyle() then shows it.
  Layer& layer() noexcept { return layer_; }
  /// Takes colours, opacity and the like from the layer.
  void restyle();

  /// Takes away detail until there are about so many points or triangles.
  void thin_to(std::size_t elements);
  void draw_full();
  /// Points of a cloud, or triangles.
  std::size_t elements() const;

 private:
  void paint(vtkPolyDataMapper& mapper) const;
  void draw(vtkPolyDataMapper* mapper);
  bool is_textured(vtkPolyDataMapper& mapper) const;

  Layer layer_;
  vtkSmartPointer<vtkPolyDataMapper> full_, thin_;
  std::size_t thinned_to_ = 0;
};

}  // namespace groundray
