#pragma once

#include <QWidget>
#include <chrono>
#include <functional>
#include <memory>

#include "apps/view/timeline.h"

namespace groundray {

/// A line for each sensor of a dataset, with a mark for each frame and a bar at the time; where it
/// is pressed is the time to go to.
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
