#include "apps/view/window/panels/event_strip.h"

#include <QMouseEvent>
#include <QPainter>
#include <algorithm>

namespace groundray {
namespace {

constexpr int row_px = 14;
constexpr int strip_margin_px = 6;

QColor sensor_colour(std::size_t sensor) {
  return QColor::fromHsv(static_cast<int>((200 + sensor * 67) % 360), 150, 230);
}

}  // namespace

EventStrip::EventStrip(std::function<void(std::chrono::nanoseconds)> went, QWidget* parent)
    : QWidget(parent), went_(std::move(went)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setCursor(Qt::SizeHorCursor);
}

void EventStrip::show_timeline(std::shared_ptr<const Timeline> timeline) {
  timeline_ = std::move(timeline);
  updateGeometry();
  update();
}

void EventStrip::set_time(std::chrono::nanoseconds time) {
  time_ = time;
  update();
}

QSize EventStrip::sizeHint() const {
  const int rows = timeline_ == nullptr ? 1 : static_cast<int>(timeline_->sensors().size());
  return {200, std::clamp(rows, 1, 12) * row_px + 4};
}

int EventStrip::names_width() const {
  int width = 0;
  if (timeline_ == nullptr) return width;
  for (const RecordedSensor& sensor : timeline_->sensors()) {
    width = std::max(width, fontMetrics().horizontalAdvance(QString::fromStdString(sensor.name)));
  }
  return width + 2 * strip_margin_px;
}

double EventStrip::x_of(std::chrono::nanoseconds time) const {
  const double span = static_cast<double>((timeline_->end() - timeline_->begin()).count());
  const double share =
      span > 0 ? static_cast<double>((time - timeline_->begin()).count()) / span : 0;
  return names_width() + share * (width() - names_width() - strip_margin_px);
}

void EventStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().base());
  if (timeline_ == nullptr) return;
  for (std::size_t i = 0; i < timeline_->sensors().size(); ++i) {
    const int top = 2 + static_cast<int>(i) * row_px;
    const RecordedSensor& sensor = timeline_->sensors()[i];
    painter.setPen(palette().text().color());
    painter.drawText(QRect(strip_margin_px, top, names_width(), row_px), Qt::AlignVCenter,
                     QString::fromStdString(sensor.name));
    painter.setPen(palette().mid().color());
    painter.drawLine(names_width(), top + row_px / 2, width() - strip_margin_px, top + row_px / 2);
    const auto current = timeline_->current(i, time_);
    double last_x = -1;
    for (std::size_t k = 0; k < sensor.frames.size(); ++k) {
      const double x = x_of(sensor.frames[k].stamp);
      const bool is_current = current == k;
      if (x < last_x + 1 && !is_current) continue;  // a second mark on the same pixel
      last_x = x;
      painter.fillRect(
          QRectF(x - (is_current ? 1.5 : 0.5), top + 2, is_current ? 4 : 2, row_px - 4),
          is_current ? QColor(Qt::white) : sensor_colour(i));
    }
  }
  painter.fillRect(QRectF(x_of(time_) - 0.5, 0, 1.5, height()), QColor(255, 140, 40));
}

void EventStrip::go(int x) {
  if (timeline_ == nullptr || !went_) return;
  const int room = width() - names_width() - strip_margin_px;
  const double share =
      room > 0 ? std::clamp(static_cast<double>(x - names_width()) / room, 0.0, 1.0) : 0;
  const double span = static_cast<double>((timeline_->end() - timeline_->begin()).count());
  went_(timeline_->begin() + std::chrono::nanoseconds(static_cast<std::int64_t>(share * span)));
}

void EventStrip::mousePressEvent(QMouseEvent* event) { go(event->x()); }

void EventStrip::mouseMoveEvent(QMouseEvent* event) {
  if ((event->buttons() & Qt::LeftButton) != 0) go(event->x());
}

}  // namespace groundray
