#pragma once

#include <QColor>
#include <QImage>
#include <QPointF>
#include <QWidget>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "core/image/image.h"

namespace groundray {

/// Dot over a picture.
struct PictureDot {
  glm::dvec2 pixel{0};  ///< integers at pixel centres
  QColor colour;
};

/// Picture scaled to the available room; the wheel zooms, dragging pans.
class PictureArea : public QWidget {
 public:
  struct Hooks {
    std::function<void(glm::ivec2)> clicked{};                 ///< a pixel
    std::function<void(std::optional<glm::ivec2>)> pointed{};  ///< pixel under the mouse, if any
  };

  explicit PictureArea(Hooks hooks, QWidget* parent = nullptr);

  /// @param picture  of 1, 3 or 4 channels.
  void show_picture(const Image8& picture);
  /// Shows a text instead of a picture.
  void clear(const QString& why = {});
  /// Marks a position in the picture; std::nullopt removes the mark.
  void mark(std::optional<glm::dvec2> pixel);

  /// Shows dots over the picture; another picture leaves them.
  void show_dots(std::vector<PictureDot> dots);
  const std::vector<PictureDot>& dots() const noexcept { return dots_; }

  /// Returns the position of a pixel's centre in this widget.
  QPointF place_of(glm::dvec2 pixel) const;
  QSize sizeHint() const override { return {420, 300}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;

 private:
  double scale() const;
  QPointF corner() const;
  std::optional<glm::ivec2> pixel_at(QPointF place) const;

  Hooks hooks_;
  QImage picture_;
  QString why_;      // text shown without a picture
  double zoom_ = 1;  // 1: the whole picture is visible
  QPointF shift_;    // offset of its centre from this widget's
  QPoint pressed_, dragged_;
  bool is_drag_ = false;
  std::optional<glm::dvec2> mark_;
  std::vector<PictureDot> dots_;
};

}  // namespace groundray
