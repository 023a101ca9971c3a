#pragma once

// Private parts of View, for its sources.

#include <vtkRenderPass.h>
#include <vtkTextActor.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/rendering/clip_box.h"
#include "apps/view/rendering/legend.h"
#include "apps/view/rendering/moving_detail.h"
#include "apps/view/rendering/shown_layer.h"
#include "apps/view/rendering/view.h"

namespace groundray {

struct View::Impl {
  static constexpr glm::dvec3 sky{0.40, 0.50, 0.62}, haze{0.80, 0.83, 0.86};  // background

  vtkSmartPointer<vtkRenderWindow> window;
  vtkSmartPointer<vtkRenderer> renderer = vtkSmartPointer<vtkRenderer>::New();
  std::vector<std::unique_ptr<ShownLayer>> layers;
  std::unique_ptr<Legend> legend;
  std::string legend_layer;  // layer whose legend is shown
  std::optional<glm::dvec3> origin_w_m;
  bool is_moving = false, is_legend_visible = true;
  MovingDetail detail;
  vtkSmartPointer<vtkRenderPass> eye_dome;  // null until it is first used
  double exposure_ev = 0;
  std::optional<ClipBox> clip;
  std::optional<ViewLabel> label;
  vtkSmartPointer<vtkTextActor> label_actor;  // null until it is first used

  glm::dvec3 origin() const { return origin_w_m.value_or(glm::dvec3(0)); }
  ShownLayer* find(const std::string& name) const;
  ShownLayer& at(const std::string& name) const;  // throws Error if there is none
  void update_legend();
  void set_detail();
  void place_label();  // for the present viewpoint
  void fit(const std::array<double, 6>& bounds);
  glm::dvec2 size_px() const { return {window->GetSize()[0], window->GetSize()[1]}; }
  PickRay ray(int x_px, int y_px) const;
  void draw_part(glm::ivec2 first_px, glm::ivec2 part_px, Image8& whole);
};

}  // namespace groundray
