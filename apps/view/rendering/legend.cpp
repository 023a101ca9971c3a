#include "apps/view/rendering/legend.h"

#include <fmt/format.h>
#include <vtkActor2D.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper2D.h>
#include <vtkProperty2D.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/rendering/colour_table.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr std::size_t most_kinds = 24;
constexpr int strips = 128;  // number of rectangles in a colour bar

struct Mark {
  double share = 0;  // fraction of the bar's height
  std::string text;
};

// Returns round numbers in a range, spaced by 1, 2 or 5 times a power of ten.
std::vector<Mark> marks_in(glm::dvec2 range) {
  const double span = range.y - range.x;
  constexpr double wanted = 5;
  const double power = math::pow(10, std::floor(math::log10(span / wanted)));
  if (!std::isnormal(power) || !std::isfinite(span)) return {{0.5, fmt::format("{:.6g}", range.x)}};
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (span / (factor * power) >= wanted - 1.5 && span / (factor * power) <= 2 * wanted) {
      step = factor * power;
      break;
    }
  }
  const int decimals = std::max(0, -static_cast<int>(std::floor(math::log10(step) + 1e-9)));
  const bool is_plain = decimals <= 5 && std::max(std::abs(range.x), std::abs(range.y)) < 1e7;
  std::vector<Mark> marks;
  const double first = std::ceil(range.x / step - 1e-9);
  constexpr int most = 50;
  double last = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < most; ++i) {
    const double value = first + i == 0 ? 0 : (first + i) * step;
    if (value > range.y + 1e-9 * span) break;
    if (value <= last) continue;  // the step is below double precision
    last = value;
    marks.push_back({(value - range.x) / span, is_plain ? fmt::format("{:.{}f}", value, decimals)
                                                        : fmt::format("{:.3g}", value)});
  }
  return marks;
}

}  // namespace

struct Legend::Parts {
  // Rectangles in pixels from the lower left corner.
  class Rectangles {
   public:
    Rectangles() {
      colours_->SetNumberOfComponents(3);
      data_->SetPoints(points_);
      data_->SetPolys(cells_);
      data_->GetCellData()->SetScalars(colours_);
      mapper_->SetInputData(data_);
      mapper_->SetColorModeToDirectScalars();
      mapper_->SetScalarModeToUseCellData();
      actor_->SetMapper(mapper_);
    }

    vtkActor2D& actor() { return *actor_; }
    void clear() {
      points_->Reset();
      cells_->Reset();
      colours_->Reset();
      data_->Modified();
    }
    void add(glm::dvec2 low_px, glm::dvec2 high_px, const glm::dvec3& colour) {
      const std::array<vtkIdType, 4> corners = {points_->InsertNextPoint(low_px.x, low_px.y, 0),
                                                points_->InsertNextPoint(high_px.x, low_px.y, 0),
                                                points_->InsertNextPoint(high_px.x, high_px.y, 0),
                                                points_->InsertNextPoint(low_px.x, high_px.y, 0)};
      cells_->InsertNextCell(4, corners.data());
      const glm::dvec3 bytes = 255.0 * colour;
      colours_->InsertNextTuple3(bytes.x, bytes.y, bytes.z);
      points_->Modified();
      data_->Modified();
    }

   private:
    vtkNew<vtkPoints> points_;
    vtkNew<vtkCellArray> cells_;
    vtkNew<vtkUnsignedCharArray> colours_;
    vtkNew<vtkPolyData> data_;
    vtkNew<vtkPolyDataMapper2D> mapper_;
    vtkNew<vtkActor2D> actor_;
  };

  vtkRenderer* renderer = nullptr;
  Rectangles panel, bar;
  std::vector<vtkSmartPointer<vtkTextActor>> texts;
  std::optional<LayerColumn> column;
  glm::ivec2 size_px{0}, first_px{0};
  bool is_wanted = true;

  void lay_out();
  void add_text(const std::string& text, glm::dvec2 at_px, double letter_px, bool is_title);
  void lay_out_bar(double letter_px, glm::dvec2 corner_px);
  void lay_out_kinds(double letter_px, glm::dvec2 corner_px);
};

void Legend::Parts::add_text(const std::string& text, glm::dvec2 at_px, double letter_px,
                             bool is_title) {
  auto actor = vtkSmartPointer<vtkTextActor>::New();
  actor->SetInput(text.c_str());
  actor->SetTextScaleModeToNone();
  vtkTextProperty& property = *actor->GetTextProperty();
  property.SetFontFamilyToArial();
  property.SetFontSize(static_cast<int>(letter_px));
  property.SetBold(is_title ? 1 : 0);
  property.SetColor(0.96, 0.97, 0.98);
  property.SetJustificationToLeft();
  property.SetVerticalJustificationToCentered();
  actor->SetPosition(at_px.x, at_px.y);
  actor->SetLayerNumber(2);
  renderer->AddActor2D(actor);
  texts.push_back(actor);
}

void Legend::Parts::lay_out_bar(double letter_px, glm::dvec2 corner_px) {
  const double height = 16 * letter_px, width = 1.3 * letter_px;
  const double span = column->range.y - column->range.x;
  for (int i = 0; i < strips; ++i) {
    bar.add(corner_px + glm::dvec2(0, height * i / strips),
            corner_px + glm::dvec2(width, height * (i + 1) / strips),
            colour_on(column->scale, span > 0 ? (i + 0.5) / strips : 0.5));
  }
  for (const Mark& mark : marks_in(column->range)) {
    const glm::dvec2 at = corner_px + glm::dvec2(width, height * mark.share);
    bar.add(at - glm::dvec2(0, 0.5), at + glm::dvec2(0.35 * letter_px, 0.5), glm::dvec3(0.96));
    add_text(mark.text, at + glm::dvec2(0.7 * letter_px, 0), letter_px, false);
  }
}

void Legend::Parts::lay_out_kinds(double letter_px, glm::dvec2 corner_px) {
  const std::size_t count = std::min(column->categories.size(), most_kinds);
  std::size_t i = 0;
  for (const auto& [kind, name] : column->categories) {
    if (i == count) break;
    const double rows = static_cast<double>(count - 1 - i++);
    const glm::dvec2 at = corner_px + glm::dvec2(0, 1.6 * letter_px * rows);
    bar.add(at, at + glm::dvec2(1.2 * letter_px), colour_of_kind(*column, kind));
    add_text(name.empty() ? std::to_string(kind) : name,
             at + glm::dvec2(1.8 * letter_px, 0.6 * letter_px), letter_px, false);
  }
}

void Legend::Parts::lay_out() {
  for (const auto& text : texts) renderer->RemoveActor2D(text);
  texts.clear();
  panel.clear();
  bar.clear();
  const bool is_shown = is_wanted && column.has_value() && size_px.y > 0;
  panel.actor().SetVisibility(is_shown ? 1 : 0);
  bar.actor().SetVisibility(is_shown ? 1 : 0);
  if (!is_shown) return;
  const double letter_px = std::clamp(size_px.y / 50, 11, 200);
  const bool has_kinds = !column->categories.empty();
  const std::size_t kinds = std::min(column->categories.size(), most_kinds);
  const std::string title =
      column->unit.empty() ? column->name : fmt::format("{} [{}]", column->name, column->unit);
  std::size_t longest = has_kinds ? 4 : 8;
  if (has_kinds) {
    for (const auto& [kind, name] : column->categories) longest = std::max(longest, name.size());
  }
  const double letters =
      std::max(0.62 * static_cast<double>(title.size()),
               2.2 + 0.58 * static_cast<double>(std::min<std::size_t>(longest, 40)));
  const glm::dvec2 inner(
      (letters + 0.4) * letter_px,
      has_kinds ? (1.6 * static_cast<double>(kinds) + 1.4) * letter_px : 18 * letter_px);
  const double rim = 0.9 * letter_px;
  const glm::dvec2 size = inner + 2 * rim;
  const glm::dvec2 low =
      glm::dvec2(size_px.x - letter_px - size.x, letter_px) - glm::dvec2(first_px);
  const glm::dvec2 high = low + size;
  panel.add(low, high, {0.10, 0.12, 0.15});
  add_text(title, {low.x + rim, high.y - rim - 0.4 * letter_px}, letter_px, true);
  if (has_kinds) {
    lay_out_kinds(letter_px, low + rim);
  } else {
    lay_out_bar(letter_px, low + rim);
  }
}

Legend::Legend(vtkRenderer& renderer) : parts_(std::make_unique<Parts>()) {
  parts_->renderer = &renderer;
  parts_->panel.actor().GetProperty()->SetOpacity(0.62);
  parts_->panel.actor().SetLayerNumber(0);
  parts_->bar.actor().SetLayerNumber(1);
  renderer.AddActor2D(&parts_->panel.actor());
  renderer.AddActor2D(&parts_->bar.actor());
  parts_->lay_out();
}

Legend::~Legend() = default;

void Legend::show(const Layer* layer) {
  const LayerColumn* const column = layer == nullptr ? nullptr : layer->find(layer->coloured_by);
  parts_->column.reset();
  if (column != nullptr && !column->is_rgb && layer->visible) parts_->column = *column;
  parts_->lay_out();
}

void Legend::set_visible(bool visible) {
  parts_->is_wanted = visible;
  parts_->lay_out();
}

void Legend::fit_to(glm::ivec2 size_px, glm::ivec2 first_px) {
  if (parts_->size_px == size_px && parts_->first_px == first_px) return;
  parts_->size_px = size_px;
  parts_->first_px = first_px;
  parts_->lay_out();
}

}  // namespace groundray
