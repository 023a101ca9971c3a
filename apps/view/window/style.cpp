#include "apps/view/window/style.h"

#include <QApplication>
#include <QPainter>
#include <QPainterPath>
#include <QPalette>
#include <QPixmap>
#include <QProxyStyle>
#include <QStyleFactory>
#include <QStyleOption>
#include <algorithm>
#include <functional>
#include <map>

namespace groundray {
namespace {

constexpr int sign_px = 48;  // drawn on a square of 24 units
const QColor line_colour(214, 219, 227);
const QColor accent_colour(255, 158, 66);

void draw_folder(QPainter& painter) {
  QPainterPath path(QPointF(3, 19));
  path.lineTo(3, 5);
  path.lineTo(9, 5);
  path.lineTo(11, 8);
  path.lineTo(20, 8);
  path.lineTo(20, 19);
  path.closeSubpath();
  painter.drawPath(path);
}

void draw_file(QPainter& painter) {
  painter.drawPolygon(QPolygonF(QVector<QPointF>{{5, 3}, {14, 3}, {19, 8}, {19, 21}, {5, 21}}));
  painter.drawPolyline(QPolygonF(QVector<QPointF>{{14, 3}, {14, 8}, {19, 8}}));
}

void draw_camera(QPainter& painter) {
  painter.drawRoundedRect(QRectF(3, 7, 18, 12), 2, 2);
  painter.drawEllipse(QPointF(12, 13), 3.6, 3.6);
  painter.drawLine(QPointF(9, 7), QPointF(10, 4.5));
  painter.drawLine(QPointF(10, 4.5), QPointF(14, 4.5));
  painter.drawLine(QPointF(14, 4.5), QPointF(15, 7));
}

void draw_fit(QPainter& painter) {
  for (const double x : {4.0, 20.0}) {
    for (const double y : {4.0, 20.0}) {
      const double inward_x = x < 12 ? 4 : -4;
      const double inward_y = y < 12 ? 4 : -4;
      painter.drawLine(QPointF(x, y), QPointF(x + inward_x, y));
      painter.drawLine(QPointF(x, y), QPointF(x, y + inward_y));
    }
  }
  painter.drawEllipse(QPointF(12, 12), 3.5, 3.5);
}

// Draws a box with one side filled.
void draw_box(QPainter& painter, const QPolygonF& side) {
  painter.setBrush(accent_colour);
  painter.drawPolygon(side);
  painter.setBrush(Qt::NoBrush);
  painter.drawPolygon(
      QPolygonF(QVector<QPointF>{{12, 3}, {20, 7}, {20, 16}, {12, 21}, {4, 16}, {4, 7}}));
  painter.drawPolyline(QPolygonF(QVector<QPointF>{{4, 7}, {12, 11}, {20, 7}}));
  painter.drawLine(QPointF(12, 11), QPointF(12, 21));
}

void draw_wireframe(QPainter& painter) {
  painter.drawPolygon(QPolygonF(QVector<QPointF>{{3, 19}, {8, 6}, {21, 19}}));
  painter.drawPolyline(QPolygonF(QVector<QPointF>{{8, 6}, {11, 19}, {14.5, 12.5}, {8, 6}}));
  painter.drawPolyline(QPolygonF(QVector<QPointF>{{5.5, 12.5}, {11, 19}}));
}

void draw_legend(QPainter& painter) {
  painter.drawRect(QRectF(5, 3, 5, 18));
  painter.fillRect(QRectF(6, 10, 3, 10), accent_colour);
  for (const double y : {3.0, 9.0, 15.0, 21.0}) painter.drawLine(QPointF(13, y), QPointF(19, y));
}

void draw_scan(QPainter& painter) {
  painter.drawRect(QRectF(9, 3, 6, 5));
  painter.setPen(QPen(accent_colour, 1.4));
  for (const double x : {3.0, 7.5, 12.0, 16.5, 21.0}) {
    painter.drawLine(QPointF(12, 9.5), QPointF(x, 20));
  }
  painter.setPen(QPen(line_colour, 1.6));
  painter.drawLine(QPointF(2, 21), QPointF(22, 21));
}

void draw_compare(QPainter& painter) {
  painter.drawLine(QPointF(3, 21), QPointF(21, 21));
  painter.setPen(Qt::NoPen);
  painter.setBrush(line_colour);
  double x = 4;
  for (const double tall : {4.0, 9.0, 16.0, 11.0, 5.0}) {
    painter.setBrush(tall > 12 ? accent_colour : line_colour);
    painter.drawRect(QRectF(x, 20.5 - tall, 2.4, tall));
    x += 3.4;
  }
}

void draw_help(QPainter& painter) {
  painter.drawEllipse(QPointF(12, 12), 9, 9);
  QFont font = painter.font();
  font.setPixelSize(13);
  font.setBold(true);
  painter.setFont(font);
  painter.drawText(QRectF(3, 3, 18, 18), Qt::AlignCenter, "?");
}

void draw_triangle(QPainter& painter, double from_x, double to_x) {
  painter.drawPolygon(QPolygonF(QVector<QPointF>{{from_x, 5}, {to_x, 12}, {from_x, 19}}));
}

void draw_play(QPainter& painter) {
  painter.setBrush(line_colour);
  draw_triangle(painter, 7, 19);
}

void draw_pause(QPainter& painter) {
  painter.fillRect(QRectF(6, 5, 4, 14), accent_colour);
  painter.fillRect(QRectF(14, 5, 4, 14), accent_colour);
}

void draw_back(QPainter& painter) {
  painter.setBrush(line_colour);
  draw_triangle(painter, 18, 8);
  painter.drawLine(QPointF(6, 5), QPointF(6, 19));
}

void draw_forward(QPainter& painter) {
  painter.setBrush(line_colour);
  draw_triangle(painter, 6, 16);
  painter.drawLine(QPointF(18, 5), QPointF(18, 19));
}

void draw_close(QPainter& painter) {
  painter.drawLine(QPointF(6, 6), QPointF(18, 18));
  painter.drawLine(QPointF(6, 18), QPointF(18, 6));
}

// Draws a window that is detached from another.
void draw_float(QPainter& painter) {
  painter.drawRect(QRectF(5, 9, 10, 10));
  painter.drawPolyline(QPolygonF(QVector<QPointF>{{9, 9}, {9, 5}, {19, 5}, {19, 15}, {15, 15}}));
}

const std::map<Sign, std::function<void(QPainter&)>>& drawings() {
  const QPolygonF top(QVector<QPointF>{{12, 3}, {20, 7}, {12, 11}, {4, 7}});
  const QPolygonF left(QVector<QPointF>{{4, 7}, {12, 11}, {12, 21}, {4, 16}});
  const QPolygonF right(QVector<QPointF>{{20, 7}, {12, 11}, {12, 21}, {20, 16}});
  static const std::map<Sign, std::function<void(QPainter&)>> all{
      {Sign::Open, draw_file},
      {Sign::OpenFolder, draw_folder},
      {Sign::Save, draw_camera},
      {Sign::Fit, draw_fit},
      {Sign::Top, [top](QPainter& painter) { draw_box(painter, top); }},
      {Sign::South, [left](QPainter& painter) { draw_box(painter, left); }},
      {Sign::East, [right](QPainter& painter) { draw_box(painter, right); }},
      {Sign::Oblique, [](QPainter& painter) { draw_box(painter, QPolygonF()); }},
      {Sign::Wireframe, draw_wireframe},
      {Sign::Legend, draw_legend},
      {Sign::Scan, draw_scan},
      {Sign::Compare, draw_compare},
      {Sign::Help, draw_help},
      {Sign::Play, draw_play},
      {Sign::Pause, draw_pause},
      {Sign::Back, draw_back},
      {Sign::Forward, draw_forward},
      {Sign::Close, draw_close},
      {Sign::Float, draw_float}};
  return all;
}

QPalette dark_palette() {
  QPalette palette;
  const QColor text(222, 226, 232);
  const QColor grey(128, 134, 143);
  palette.setColor(QPalette::Window, QColor(43, 47, 54));
  palette.setColor(QPalette::WindowText, text);
  palette.setColor(QPalette::Base, QColor(31, 34, 40));
  palette.setColor(QPalette::AlternateBase, QColor(36, 40, 46));
  palette.setColor(QPalette::ToolTipBase, QColor(58, 63, 72));
  palette.setColor(QPalette::ToolTipText, text);
  palette.setColor(QPalette::PlaceholderText, grey);
  palette.setColor(QPalette::Text, text);
  palette.setColor(QPalette::Button, QColor(55, 60, 69));
  palette.setColor(QPalette::ButtonText, text);
  palette.setColor(QPalette::BrightText, Qt::white);
  palette.setColor(QPalette::Link, QColor(110, 175, 255));
  palette.setColor(QPalette::Highlight, QColor(52, 101, 164));
  palette.setColor(QPalette::HighlightedText, Qt::white);
  for (const auto role : {QPalette::Text, QPalette::ButtonText, QPalette::WindowText}) {
    palette.setColor(QPalette::Disabled, role, QColor(118, 123, 131));
  }
  return palette;
}

// Draws a check box that is visible on a dark background in every state.
void draw_check_box(QPainter& painter, const QRect& place, QStyle::State state) {
  const bool is_enabled = (state & QStyle::State_Enabled) != 0;
  const double side = std::min({place.width(), place.height(), 14}) - 1;
  const QRectF box(place.center().x() - side / 2 + 0.5, place.center().y() - side / 2 + 0.5, side,
                   side);
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(is_enabled ? QColor(132, 140, 152) : QColor(84, 89, 97), 1));
  painter.setBrush(QColor(31, 34, 40));
  painter.drawRoundedRect(box, 2, 2);
  const QColor mark = is_enabled ? line_colour : QColor(118, 123, 131);
  if ((state & QStyle::State_On) != 0) {
    painter.setPen(QPen(mark, 1.8, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
    const auto at = [&](double x, double y) {
      return QPointF(box.x() + x * side, box.y() + y * side);
    };
    painter.drawPolyline(
        QPolygonF(QVector<QPointF>{at(0.22, 0.52), at(0.42, 0.74), at(0.78, 0.28)}));
  } else if ((state & QStyle::State_NoChange) != 0) {
    painter.fillRect(box.adjusted(0.28 * side, 0.28 * side, -0.28 * side, -0.28 * side), mark);
  }
  painter.restore();
}

// Fusion with dock buttons and check boxes that suit dark windows.
class CalmStyle : public QProxyStyle {
 public:
  CalmStyle() : QProxyStyle(QStyleFactory::create("Fusion")) {}
  QIcon standardIcon(StandardPixmap which, const QStyleOption* option,
                     const QWidget* widget) const override {
    if (which == SP_TitleBarCloseButton) return icon_of(Sign::Close);
    if (which == SP_TitleBarNormalButton) return icon_of(Sign::Float);
    return QProxyStyle::standardIcon(which, option, widget);
  }
  void drawPrimitive(PrimitiveElement which, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override {
    if (which == PE_IndicatorCheckBox || which == PE_IndicatorItemViewItemCheck) {
      return draw_check_box(*painter, option->rect, option->state);
    }
    QProxyStyle::drawPrimitive(which, option, painter, widget);
  }
};

}  // namespace

void set_style(QApplication& application) {
  application.setStyle(new CalmStyle);
  application.setPalette(dark_palette());
  application.setStyleSheet(
      "QToolTip { color: #dee2e8; background: #3a3f48; border: 1px solid #5a616d; padding: 3px; }"
      "QDockWidget { font-weight: bold; }"
      "QDockWidget::title { background: #363b43; padding: 5px 6px; }"
      "QToolBar { border: 0; spacing: 2px; padding: 3px; }"
      "QMainWindow::separator { background: #23262c; width: 4px; height: 4px; }"
      "QStatusBar::item { border: 0; }");
}

QIcon icon_of(Sign sign) {
  QPixmap pixmap(sign_px, sign_px);
  pixmap.fill(Qt::transparent);
  QPainter painter(&pixmap);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.scale(sign_px / 24.0, sign_px / 24.0);
  painter.setPen(QPen(line_colour, 1.6, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  drawings().at(sign)(painter);
  return {pixmap};
}

}  // namespace groundray
