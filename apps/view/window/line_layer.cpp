#include "apps/view/window/line_layer.h"

#include "apps/view/layers/sensor_layer.h"

namespace groundray {

Layer line_layer(const std::string& name, LayerKind kind, const glm::dvec3& origin_w_m,
                 const Lines& lines_m, const Pen& pen) {
  LineDrawing drawing;
  for (const std::vector<glm::dvec3>& line : lines_m) drawing.add(line, pen.rgb);
  Layer layer = line_layer(name, kind, drawing, origin_w_m);
  layer.line_width_px = pen.width_px;
  return layer;
}

Layer axes_layer(const std::string& name, const glm::dvec3& origin_w_m, const Pose& X_DS,
                 double length_m) {
  LineDrawing drawing;
  add_axes(drawing, X_DS, length_m);
  Layer layer = line_layer(name, LayerKind::Sensors, drawing, origin_w_m);
  layer.line_width_px = 3;
  return layer;
}

Lines box_edges(const glm::dvec3& middle_m, const glm::dvec3& half_m) {
  const auto corner = [&](int i) {
    return middle_m +
           half_m * glm::dvec3((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
  };
  Lines edges;
  for (int i = 0; i < 8; ++i) {
    for (int bit = 1; bit < 8; bit *= 2) {
      if ((i & bit) == 0) edges.push_back({corner(i), corner(i | bit)});
    }
  }
  return edges;
}

}  // namespace groundray
