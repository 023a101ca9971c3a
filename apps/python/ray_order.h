#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "core/tracing/ray.h"

namespace groundray::python {

/// Number of neighbours that are traced together: the widest packet of Embree.
inline constexpr std::size_t packet_rays = 16;

/// Returns whether a packet is traced faster as one beam than ray by ray: its rays start within a
/// metre of the first and deviate from it by less than 0.2 rad.
bool are_alike(std::span<const Ray> packet) noexcept;

/// Order of rays in which packets of neighbours are as alike as possible. It affects only the
/// speed of tracing. An object keeps its memory for the next rays.
class RayOrder {
 public:
  /// @param height_m  medium height of the ground.
  explicit RayOrder(double height_m) : height_m_(height_m) {}

  /// Finds an order, unless packets are alike in the given one.
  /// @return indices of `rays`, valid until the next call; or empty for the given order.
  std::span<const std::uint32_t> sort(std::span<const Ray> rays);

 private:
  double height_m_;
  std::vector<glm::dvec2> places_;
  std::vector<std::uint32_t> keys_, ends_, order_;
};

}  // namespace groundray::python
