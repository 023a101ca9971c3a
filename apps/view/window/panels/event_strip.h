#pragma once

#include <QWidget>
#include <chrono>
#include <functional>
#include <memory>

#include "apps/view/recorded/timeline.h"

namespace groundray {

/// Timeline with a line for each sensor of a dataset, a mark for each frame and a bar at the
/// current time; a press goes to the time at the mouse.
class EventStrip : public QWidget {
 public:
  explicit EventStrip(std::function<void(std::chrono::nanoseconds)> went,
                      QWidget* parent = nullptr);

  void show_timeline(std::shared_ptr<const Timeline> timeline);
  void set_time(std::chrono::nanoseconds time);
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override { return sizeHint(); }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;

 private:
  int names_width() const;
  double x_of(std::chrono::nanoseconds time) const;
  void go(int x);

  std::function<void(std::chrono::nanoseconds)> went_;
  std::shared_ptr<const Timeline> timeline_;
  std::chrono::nanoseconds time_{0};
};

}  // namespace groundray
