#include "apps/view/layers/line_layer.h"

#include <array>
#include <cstdint>
#include <glm/common.hpp>

namespace groundray {

void add_axes(LineDrawing& drawing, const Pose& X_DF, double length_m) {
  constexpr std::array<glm::u8vec3, 3> colours = {
      glm::u8vec3(224, 62, 54), {70, 170, 70}, {60, 110, 220}};
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    glm::dvec3 tip(0);
    tip[axis] = length_m;
    drawing.add({X_DF * glm::dvec3(0), X_DF * tip}, colours[static_cast<std::size_t>(axis)]);
  }
}

void add_box(LineDrawing& drawing, const glm::dvec3& middle_m, const glm::dvec3& half_m,
             glm::u8vec3 rgb) {
  const auto corner = [&](int i) {
    return middle_m +
           half_m * glm::dvec3((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  };
  for (int i = 0; i < 8; ++i) {
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((i & bit) == 0) drawing.add({corner(i), corner(i | bit)}, rgb);
    }
  }
}

Layer line_layer(const std::string& name, LayerKind kind, const glm::dvec3& origin_w_m,
                 const LineDrawing& drawing, double width_px) {
  std::vector<std::size_t> lengths;
  std::size_t all = 0;
  for (const LineDrawing::Run& run : drawing.runs) {
    if (run.points_m.size() < 2) continue;
    lengths.push_back(run.points_m.size());
    all += run.points_m.size();
  }
  Layer layer{.name = name, .kind = kind, .data = make_points(all)};
  const glm::dvec3 origin = all == 0 ? glm::dvec3(0) : glm::round(drawing.runs[0].points_m[0]);
  layer.origin_w_m = origin_w_m + origin;
  const auto places = coordinates(*layer.data);
  std::vector<std::uint8_t> rgb;
  std::size_t next = 0;
  for (const LineDrawing::Run& run : drawing.runs) {
    if (run.points_m.size() < 2) continue;
    for (const glm::dvec3& p : run.points_m) {
      for (glm::length_t k = 0; k < 3; ++k) {
        places[next++] = static_cast<float>(p[k] - origin[k]);
        rgb.push_back(run.rgb[k]);
      }
    }
  }
  set_lines(*layer.data, lengths);
  add_colours(layer, {.name = "colour", .unit = ""}, rgb);
  layer.coloured_by = "colour";
  layer.line_width_px = width_px;
  return layer;
}

}  // namespace groundray
