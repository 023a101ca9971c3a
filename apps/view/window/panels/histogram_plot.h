#pragma once

#include <QWidget>
#include <glm/vec2.hpp>
#include <optional>

#include "apps/view/compare/deviation.h"

namespace groundray {

/// Histogram of deviations, in the colours of the surface.
class HistogramPlot : public QWidget {
 public:
  explicit HistogramPlot(QWidget* parent = nullptr);

  /// @param colours_m  deviations at the ends of the colours, m.
  void show_histogram(std::optional<DeviationHistogram> histogram, glm::dvec2 colours_m);
  QSize sizeHint() const override { return {300, 180}; }
  QSize minimumSizeHint() const override { return {160, 120}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::optional<DeviationHistogram> histogram_;
  glm::dvec2 colours_m_{-1, 1};
};

}  // namespace groundray
