#pragma once

#include <vtkRenderer.h>

#include <glm/vec2.hpp>
#include <memory>

#include "apps/view/rendering/layer.h"

namespace groundray {

/// Legend of a view: a colour bar with numbers, or the kinds by name.
class Legend {
 public:
  explicit Legend(vtkRenderer& renderer);
  ~Legend();
  Legend(const Legend&) = delete;
  Legend& operator=(const Legend&) = delete;

  /// Shows the legend of a layer; hides it if the layer is not coloured by a column of values.
  void show(const Layer* layer);
  void set_visible(bool visible);
  /// Scales text and bar to a picture of `size_px`.
  /// @param first_px  lower left pixel of the part of the picture that is drawn.
  void fit_to(glm::ivec2 size_px, glm::ivec2 first_px = {0, 0});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace groundray
