#include "apps/view/window/panels/picture_area.h"

#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>
#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/view/window/style.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr double most_zoom = 200;

QImage::Format format_of(const Image8& picture) {
  return picture.channels() == 1   ? QImage::Format_Grayscale8
         : picture.channels() == 4 ? QImage::Format_RGBA8888
                                   : QImage::Format_RGB888;
}

}  // namespace

PictureArea::PictureArea(Hooks hooks, QWidget* parent) : QWidget(parent), hooks_(std::move(hooks)) {
  setMouseTracking(true);
  setMinimumSize(120, 90);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
  setCursor(Qt::CrossCursor);
}

void PictureArea::show_picture(const Image8& picture) {
  const bool same_size =
      picture.width() == picture_.width() && picture.height() == picture_.height();
  if (!same_size) {
    zoom_ = 1;
    shift_ = {};
    mark_.reset();
  }
  picture_ = QImage(picture.values().data(), picture.width(), picture.height(),
                    picture.width() * picture.channels(), format_of(picture))
                 .copy();
  update();
}

void PictureArea::clear(const QString& why) {
  why_ = why;
  picture_ = {};
  mark_.reset();
  update();
}

void PictureArea::mark(std::optional<glm::dvec2> pixel) {
  mark_ = pixel;
  update();
}

void PictureArea::show_dots(std::vector<PictureDot> dots) {
  dots_ = std::move(dots);
  update();
}

double PictureArea::scale() const {
  if (picture_.isNull()) return 1;
  return zoom_ * std::min(static_cast<double>(width()) / picture_.width(),
                          static_cast<double>(height()) / picture_.height());
}

QPointF PictureArea::corner() const {
  return QPointF(width() / 2.0, height() / 2.0) + shift_ -
         scale() * QPointF(picture_.width() / 2.0, picture_.height() / 2.0);
}

QPointF PictureArea::place_of(glm::dvec2 pixel) const {
  return corner() + scale() * QPointF(pixel.x + 0.5, pixel.y + 0.5);
}

std::optional<glm::ivec2> PictureArea::pixel_at(QPointF place) const {
  const QPointF at = (place - corner()) / scale();
  const glm::ivec2 pixel{static_cast<int>(std::floor(at.x())),
                         static_cast<int>(std::floor(at.y()))};
  const bool is_inside =
      pixel.x >= 0 && pixel.y >= 0 && pixel.x < picture_.width() && pixel.y < picture_.height();
  return is_inside ? std::optional(pixel) : std::nullopt;
}

void PictureArea::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().base());
  if (picture_.isNull()) {
    painter.setPen(palette().placeholderText().color());
    painter.drawText(rect().adjusted(8, 8, -8, -8), Qt::AlignCenter | Qt::TextWordWrap,
                     why_.isEmpty() ? "Open a dataset with a camera, or a picture." : why_);
    return;
  }
  painter.setRenderHint(QPainter::SmoothPixmapTransform, scale() < 2);
  painter.drawImage(QRectF(corner(), scale() * QSizeF(picture_.size())), picture_);
  const double side = std::clamp(0.8 * scale(), 3.0, 9.0);
  for (const PictureDot& dot : dots_) {
    const QPointF corner = place_of(dot.pixel) - QPointF(side / 2, side / 2);
    painter.fillRect(QRectF(corner, QSizeF(side, side)), dot.colour);
  }
  if (!mark_) return;
  const QPointF at = place_of(*mark_);
  for (const auto& [colour, width] : {std::pair(QColor(Qt::black), 3), {QColor(255, 140, 40), 1}}) {
    painter.setPen(QPen(colour, width));
    painter.drawEllipse(at, 7, 7);
    painter.drawLine(at - QPointF(12, 0), at - QPointF(3, 0));
    painter.drawLine(at + QPointF(3, 0), at + QPointF(12, 0));
    painter.drawLine(at - QPointF(0, 12), at - QPointF(0, 3));
    painter.drawLine(at + QPointF(0, 3), at + QPointF(0, 12));
  }
}

void PictureArea::mousePressEvent(QMouseEvent* event) {
  pressed_ = dragged_ = event->pos();
  is_drag_ = false;
}

void PictureArea::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons() == Qt::NoButton) {
    if (hooks_.pointed) hooks_.pointed(pixel_at(event->localPos()));
    return;
  }
  is_drag_ = is_drag_ || (event->pos() - pressed_).manhattanLength() >= drag_begins_px;
  if (!is_drag_) return;
  shift_ += event->pos() - dragged_;
  dragged_ = event->pos();
  update();
}

void PictureArea::mouseReleaseEvent(QMouseEvent* event) {
  if (is_drag_ || event->button() != Qt::LeftButton) return;
  const auto pixel = pixel_at(event->localPos());
  if (!pixel) return;
  mark(glm::dvec2(*pixel));
  if (hooks_.clicked) hooks_.clicked(*pixel);
}

void PictureArea::mouseDoubleClickEvent(QMouseEvent*) {
  is_drag_ = true;  // the release that follows is not a click
  zoom_ = 1;
  shift_ = {};
  update();
}

void PictureArea::leaveEvent(QEvent*) {
  if (hooks_.pointed) hooks_.pointed(std::nullopt);
}

void PictureArea::wheelEvent(QWheelEvent* event) {
  const QPointF middle(width() / 2.0, height() / 2.0);
  const QPointF from_middle = event->position() - middle - shift_;
  const double before = zoom_;
  zoom_ = std::clamp(zoom_ * math::pow(1.2, event->angleDelta().y() / 120.0), 1.0, most_zoom);
  shift_ -= from_middle * (zoom_ / before - 1);  // the point under the mouse stays in place
  if (zoom_ <= 1) shift_ = {};
  update();
  event->accept();
}

}  // namespace groundray
