#include "apps/view/window/ruler.h"

#include <fmt/format.h>

#include <glm/geometric.hpp>

#include "apps/view/layers/line_layer.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr const char* layer_name = "measured";
constexpr glm::u8vec3 ruler_rgb{255, 226, 64};

std::string place_text(const glm::dvec3& p_w_m) {
  return fmt::format("{:.4f}, {:.4f}, {:.4f} m", p_w_m.x, p_w_m.y, p_w_m.z);
}

double horizontal_m(const glm::dvec3& d_m) { return math::hypot(d_m.x, d_m.y); }

}  // namespace

void Ruler::take(const glm::dvec3& p_w_m) {
  if (!from_w_m_ || to_w_m_) {
    from_w_m_ = p_w_m;
    to_w_m_.reset();
  } else {
    to_w_m_ = p_w_m;
  }
  draw();
}

void Ruler::clear() {
  from_w_m_.reset();
  to_w_m_.reset();
  view_.remove(layer_name);
  view_.set_label(std::nullopt);
}

void Ruler::draw() {
  const glm::dvec3 d_m = to_w_m_.value_or(*from_w_m_) - *from_w_m_;
  const double mark_m = 0.004 * glm::distance(view_.current_look().from_w_m, *from_w_m_);
  LineDrawing lines;
  add_box(lines, glm::dvec3(0), glm::dvec3(mark_m), ruler_rgb);
  if (to_w_m_) {
    add_box(lines, d_m, glm::dvec3(mark_m), ruler_rgb);
    lines.add({glm::dvec3(0), d_m}, ruler_rgb);
  }
  Layer layer = line_layer(layer_name, LayerKind::Sensors, *from_w_m_, lines, 2.5);
  layer.is_clipped = false;
  view_.add(std::move(layer));
  view_.set_label(to_w_m_ ? std::optional(ViewLabel{fmt::format("{:.3f} m", glm::length(d_m)),
                                                    *from_w_m_ + d_m / 2.0})
                          : std::nullopt);
}

FactTable::Facts Ruler::facts() const {
  FactTable::Facts facts;
  if (!from_w_m_) return facts;
  facts.emplace_back("from", place_text(*from_w_m_));
  if (!to_w_m_) return facts;
  const glm::dvec3 d_m = *to_w_m_ - *from_w_m_;
  const auto add = [&](const char* name, double metres) {
    facts.emplace_back(name, fmt::format("{:.4f} m", metres));
  };
  facts.emplace_back("to", place_text(*to_w_m_));
  add("distance", glm::length(d_m));
  add("horizontal", horizontal_m(d_m));
  add("vertical", d_m.z);
  add("difference east", d_m.x);
  add("difference north", d_m.y);
  add("difference up", d_m.z);
  return facts;
}

std::string Ruler::text() const {
  if (!from_w_m_) return "measure: click the first point";
  if (!to_w_m_) return "measure: click the second point";
  const glm::dvec3 d_m = *to_w_m_ - *from_w_m_;
  return fmt::format(
      "distance {:.4f} m, horizontal {:.4f} m, vertical {:+.4f} m (east {:+.4f}, north {:+.4f})",
      glm::length(d_m), horizontal_m(d_m), d_m.z, d_m.x, d_m.y);
}

}  // namespace groundray
