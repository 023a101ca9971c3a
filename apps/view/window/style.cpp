#include "apps/view/window/style.h"

#include <QApplication>
#include <QPainter>
#include <QPainterPath>
#include <QPalette>
#include <QPixmap>
#include <QProxyStyle>
#include <QStyleFactory>
#include <QStyleOption>
#include <QVector>
#include <algorithm>
#include <map>

namespace groundray {
namespace {

constexpr int icon_px = 48;  // drawn on a square of 24 units
const QColor line_colour(214, 219, 227);
const QColor accent_colour(255, 158, 66);

using Points = QVector<QPointF>;

// Part of an icon.
struct Part {
  QPainterPath path;
  QColor line, fill{};  // none if invalid
  double width = 1.6;
};

Part line(const Points& points, const QColor& colour = line_colour, double width = 1.6) {
  QPainterPath path;
  path.addPolygon(QPolygonF(points));
  return {path, colour, {}, width};
}

Part outline(const Points& points, const QColor& fill = {}) {
  Part part = line(points);
  part.path.closeSubpath();
  part.fill = fill;
  return part;
}

Part circle(const QPointF& centre, double radius) {
  QPainterPath path;
  path.addEllipse(centre, radius, radius);
  return {path, line_colour};
}

Part rectangle(const QRectF& place) {
  QPainterPath path;
  path.addRect(place);
  return {path, line_colour};
}

Part block(const QRectF& place, const QColor& fill) {
  QPainterPath path;
  path.addRect(place);
  return {path, {}, fill};
}

Part camera_body() {
  QPainterPath path;
  path.addRoundedRect(QRectF(3, 7, 18, 12), 2, 2);
  return {path, line_colour};
}

// Returns a box with one side filled.
QVector<Part> box(const Points& side) {
  return {outline(side, accent_colour),
          outline({{12, 3}, {20, 7}, {20, 16}, {12, 21}, {4, 16}, {4, 7}}),
          line({{4, 7}, {12, 11}, {20, 7}}), line({{12, 11}, {12, 21}})};
}

Part ray(double x) { return line({{12, 9.5}, {x, 20}}, accent_colour, 1.4); }
Part bar(double x, double tall, const QColor& fill = line_colour) {
  return block({x, 20.5 - tall, 2.4, tall}, fill);
}

const std::map<Icon, QVector<Part>>& drawings() {
  static const std::map<Icon, QVector<Part>> all{
      {Icon::Open,
       {outline({{5, 3}, {14, 3}, {19, 8}, {19, 21}, {5, 21}}), line({{14, 3}, {14, 8}, {19, 8}})}},
      {Icon::OpenFolder, {outline({{3, 19}, {3, 5}, {9, 5}, {11, 8}, {20, 8}, {20, 19}})}},
      {Icon::Save,
       {camera_body(), circle({12, 13}, 3.6), line({{9, 7}, {10, 4.5}, {14, 4.5}, {15, 7}})}},
      {Icon::Fit,
       {line({{4, 8}, {4, 4}, {8, 4}}), line({{4, 16}, {4, 20}, {8, 20}}),
        line({{20, 8}, {20, 4}, {16, 4}}), line({{20, 16}, {20, 20}, {16, 20}}),
        circle({12, 12}, 3.5)}},
      {Icon::Top, box({{12, 3}, {20, 7}, {12, 11}, {4, 7}})},
      {Icon::South, box({{4, 7}, {12, 11}, {12, 21}, {4, 16}})},
      {Icon::East, box({{20, 7}, {12, 11}, {12, 21}, {20, 16}})},
      {Icon::Oblique, box({})},
      {Icon::Wireframe,
       {outline({{3, 19}, {8, 6}, {21, 19}}), line({{8, 6}, {11, 19}, {14.5, 12.5}, {8, 6}}),
        line({{5.5, 12.5}, {11, 19}})}},
      {Icon::Legend,
       {rectangle({5, 3, 5, 18}), block({6, 10, 3, 10}, accent_colour), line({{13, 3}, {19, 3}}),
        line({{13, 9}, {19, 9}}), line({{13, 15}, {19, 15}}), line({{13, 21}, {19, 21}})}},
      {Icon::Scan,
       {rectangle({9, 3, 6, 5}), ray(3), ray(7.5), ray(12), ray(16.5), ray(21),
        line({{2, 21}, {22, 21}})}},
      {Icon::Compare,
       {line({{3, 21}, {21, 21}}), bar(4, 4), bar(7.4, 9), bar(10.8, 16, accent_colour),
        bar(14.2, 11), bar(17.6, 5)}},
      {Icon::Measure,
       {line({{3, 17}, {21, 7}}), line({{2, 14}, {4, 20}}), line({{20, 4}, {22, 10}})}},
      {Icon::Clip, {rectangle({4, 4, 16, 16}), block({8, 8, 8, 8}, accent_colour)}},
      {Icon::EyeDome, {circle({12, 12}, 9), circle({12, 12}, 5), circle({12, 12}, 2)}},
      {Icon::Help, {circle({12, 12}, 9)}},
      {Icon::Play, {outline({{7, 5}, {19, 12}, {7, 19}}, line_colour)}},
      {Icon::Pause, {block({6, 5, 4, 14}, accent_colour), block({14, 5, 4, 14}, accent_colour)}},
      {Icon::Back, {outline({{18, 5}, {8, 12}, {18, 19}}, line_colour), line({{6, 5}, {6, 19}})}},
      {Icon::Forward,
       {outline({{6, 5}, {16, 12}, {6, 19}}, line_colour), line({{18, 5}, {18, 19}})}},
      {Icon::Close, {line({{6, 6}, {18, 18}}), line({{6, 18}, {18, 6}})}},
      {Icon::Float,
       {rectangle({5, 9, 10, 10}), line({{9, 9}, {9, 5}, {19, 5}, {19, 15}, {15, 15}})}}};
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
    if (which == SP_TitleBarCloseButton) return icon_of(Icon::Close);
    if (which == SP_TitleBarNormalButton) return icon_of(Icon::Float);
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

QIcon icon_of(Icon icon) {
  QPixmap pixmap(icon_px, icon_px);
  pixmap.fill(Qt::transparent);
  QPainter painter(&pixmap);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.scale(icon_px / 24.0, icon_px / 24.0);
  for (const Part& part : drawings().at(icon)) {
    const QPen pen(part.line, part.width, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin);
    painter.setPen(part.line.isValid() ? pen : QPen(Qt::NoPen));
    painter.setBrush(part.fill.isValid() ? QBrush(part.fill) : QBrush(Qt::NoBrush));
    painter.drawPath(part.path);
  }
  if (icon == Icon::Help) {
    QFont font = painter.font();
    font.setPixelSize(13);
    font.setBold(true);
    painter.setFont(font);
    painter.drawText(QRectF(3, 3, 18, 18), Qt::AlignCenter, "?");
  }
  return {pixmap};
}

}  // namespace groundray
