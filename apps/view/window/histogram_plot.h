#pragma once

#include <QWidget>
#include <glm/vec2.hpp>
#include <optional>

#include "apps/view/deviation.h"

namespace groundray {

/// Counts of deviations as bars, coloured as the surface is.
class HistogramPlot : public QWidget {
 public:
  explicit HistogramPlot(QWidget* parent = nullptr);

  /// @param colours_m  what deviation the ends of the colours stand for.
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
