#include "apps/view/window/panels/legend_strip.h"

#include <fmt/format.h>

#include <QPainter>
#include <cmath>

#include "apps/view/window/style.h"

namespace groundray {
namespace {

constexpr int legend_margin_px = 6;
constexpr int band_px = 12;
constexpr int band_ticks = 5;
constexpr int few_ticks = 3;  // if there is no room for more

double value_at(const ImageLegend& legend, double share) {
  return legend.is_logarithmic && legend.low > 0
             ? legend.low * std::pow(legend.high / legend.low, share)
             : legend.low + share * (legend.high - legend.low);
}

}  // namespace

LegendStrip::LegendStrip(QWidget* parent) : QWidget(parent) {
  setObjectName("image_legend");
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void LegendStrip::show_legend(std::optional<ImageLegend> legend) {
  legend_ = std::move(legend);
  QStringList all;
  if (legend_) {
    for (const ImageLegend::Category& each : legend_->categories) {
      all << QString::fromStdString(fmt::format("{}: {} pixels", each.name, each.pixels));
    }
  }
  setToolTip(all.join('\n'));
  update();
}

QSize LegendStrip::sizeHint() const {
  return {300, band_px + fontMetrics().height() + 3 * legend_margin_px / 2};
}

void LegendStrip::paintEvent(QPaintEvent*) {
  if (!legend_) return;
  QPainter painter(this);
  if (legend_->categories.empty()) {
    paint_band(painter);
  } else {
    paint_categories(painter);
  }
}

void LegendStrip::paint_band(QPainter& painter) const {
  const QRect band(legend_margin_px, legend_margin_px / 2, width() - 2 * legend_margin_px, band_px);
  QLinearGradient colours(band.topLeft(), band.topRight());
  if (legend_->colours.empty()) {
    colours.setColorAt(0, Qt::black);
    colours.setColorAt(1, Qt::white);
  }
  const double last = static_cast<double>(std::max<std::size_t>(legend_->colours.size(), 2) - 1);
  for (std::size_t i = 0; i < legend_->colours.size(); ++i) {
    colours.setColorAt(static_cast<double>(i) / last, colour_of(legend_->colours[i]));
  }
  painter.fillRect(band, colours);
  painter.setPen(palette().text().color());
  const int text_room_px = painter.fontMetrics().horizontalAdvance("000.0 mm  ");
  const int ticks = band_ticks * text_room_px <= width() ? band_ticks : few_ticks;
  for (int i = 0; i < ticks; ++i) {
    const double share = static_cast<double>(i) / (ticks - 1);
    const double x = band.left() + share * band.width();
    const std::string unit = i + 1 == ticks && !legend_->unit.empty() ? " " + legend_->unit : "";
    const QString text =
        QString::fromStdString(fmt::format("{:.4g}{}", value_at(*legend_, share), unit));
    const double text_px = painter.fontMetrics().horizontalAdvance(text);
    const double left = std::clamp(x - text_px / 2, 0.0, std::max(0.0, width() - text_px - 2));
    painter.drawLine(QPointF(x, band.bottom()), QPointF(x, band.bottom() + 3));
    painter.drawText(QPointF(left, band.bottom() + 3 + painter.fontMetrics().ascent()), text);
  }
}

void LegendStrip::paint_categories(QPainter& painter) const {
  int x = legend_margin_px;
  int y = legend_margin_px / 2;
  const int line_px = painter.fontMetrics().height() + 1;
  for (const ImageLegend::Category& each : legend_->categories) {
    const QString text = QString::fromStdString(each.name);
    const int wide_px = band_px + 4 + painter.fontMetrics().horizontalAdvance(text) + 10;
    if (x + wide_px > width() && x > legend_margin_px) {
      x = legend_margin_px;
      y += line_px;
    }
    if (y + line_px > height() + 4) return;  // the tool tip lists all
    painter.fillRect(QRect(x, y + 2, band_px, line_px - 4), colour_of(each.colour));
    painter.setPen(palette().text().color());
    painter.drawText(QPoint(x + band_px + 4, y + painter.fontMetrics().ascent()), text);
    x += wide_px;
  }
}

}  // namespace groundray
