#pragma once

#include <QWidget>
#include <optional>

#include "apps/view/recorded/recorded_image.h"

namespace groundray {

/// Legend of an image's channel: a colour bar with numbers, or categories by name.
class LegendStrip : public QWidget {
 public:
  explicit LegendStrip(QWidget* parent = nullptr);

  void show_legend(std::optional<ImageLegend> legend);
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override { return {100, sizeHint().height()}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  void paint_band(QPainter& painter) const;
  void paint_categories(QPainter& painter) const;

  std::optional<ImageLegend> legend_;
};

}  // namespace groundray
