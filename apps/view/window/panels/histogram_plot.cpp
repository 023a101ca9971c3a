#include "apps/view/window/panels/histogram_plot.h"

#include <fmt/format.h>

#include <QPainter>
#include <algorithm>
#include <glm/vec3.hpp>

#include "apps/view/rendering/colour_table.h"
#include "apps/view/window/style.h"

namespace groundray {
namespace {

constexpr int plot_margin_px = 8;
constexpr int ticks = 5;

}  // namespace

HistogramPlot::HistogramPlot(QWidget* parent) : QWidget(parent) { setObjectName("histogram"); }

void HistogramPlot::show_histogram(std::optional<DeviationHistogram> histogram,
                                   glm::dvec2 colours_m) {
  histogram_ = std::move(histogram);
  colours_m_ = colours_m;
  if (histogram_) {
    setToolTip(QString::fromStdString(fmt::format("{} below {:.4g} m, {} above {:.4g} m",
                                                  histogram_->below, histogram_->low_m,
                                                  histogram_->above, histogram_->high_m)));
  }
  update();
}

void HistogramPlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().base());
  if (!histogram_ || histogram_->counts.empty()) return;
  const QFontMetrics metrics = painter.fontMetrics();
  const QRectF plot(plot_margin_px, plot_margin_px, width() - 2 * plot_margin_px,
                    height() - 2 * plot_margin_px - metrics.height() - 4);
  const std::vector<std::size_t>& counts = histogram_->counts;
  const double most = static_cast<double>(
      std::max<std::size_t>(1, *std::max_element(counts.begin(), counts.end())));
  const double bar_px = plot.width() / static_cast<double>(counts.size());
  const double span_m = histogram_->high_m - histogram_->low_m;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(counts.size());
    const double value_m = histogram_->low_m + share * span_m;
    const double tall_px = plot.height() * static_cast<double>(counts[i]) / most;
    const double in_range = (value_m - colours_m_.x) / (colours_m_.y - colours_m_.x);
    painter.fillRect(QRectF(plot.left() + static_cast<double>(i) * bar_px, plot.bottom() - tall_px,
                            std::max(1.0, bar_px - 0.5), tall_px),
                     colour_of(colour_on(ColourScale::Signed, in_range)));
  }
  painter.setPen(palette().text().color());
  painter.drawLine(plot.bottomLeft(), plot.bottomRight());
  for (int i = 0; i < ticks; ++i) {
    const double share = static_cast<double>(i) / (ticks - 1);
    const QString text = QString::fromStdString(
        fmt::format("{:.3g}{}", histogram_->low_m + share * span_m, i + 1 == ticks ? " m" : ""));
    const double x = plot.left() + share * plot.width();
    const double text_px = metrics.horizontalAdvance(text);
    painter.drawLine(QPointF(x, plot.bottom()), QPointF(x, plot.bottom() + 3));
    painter.drawText(QPointF(std::clamp(x - text_px / 2, 0.0, std::max(0.0, width() - text_px - 2)),
                             plot.bottom() + 4 + metrics.ascent()),
                     text);
  }
}

}  // namespace groundray
