#pragma once

#include <vtkRenderer.h>

#include <glm/vec2.hpp>
#include <memory>

#include "apps/view/layer.h"

namespace groundray {

/// What colours stand for: a bar with numbers at its side, or the kinds by name.
class Legend {
 public:
  explicit Legend(vtkRenderer& renderer);
  ~Legend();
  Legend(const Legend&) = delete;
  Legend& operator=(const Legend&) = delete;

  /// Explains a layer's colours, or nothing if they are not those of a column of numbers.
  void show(const Layer* layer);
  void set_visible(bool visible);
  /// Sizes letters and bar for a picture of so many pixels.
  /// @param first_px  the lower left pixel of the part of it that is drawn.
  void fit_to(glm::ivec2 size_px, glm::ivec2 first_px = {0, 0});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace groundray
