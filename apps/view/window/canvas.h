#pragma once

#include <QVTKOpenGLNativeWidget.h>

#include <QPoint>
#include <QTimer>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>

#include "apps/view/rendering/view.h"

namespace groundray {

/// View in the window, controlled by mouse and keyboard.
class Canvas : public QVTKOpenGLNativeWidget {
 public:
  /// Callbacks; any may be empty. Pixels are those of the view.
  struct Hooks {
    std::function<void(glm::ivec2 at_px, Qt::KeyboardModifiers)> clicked{};
    /// Called after `take_place`, with the pixels where the button was pressed and released.
    std::function<void(glm::ivec2 at_px, glm::ivec2 towards_px)> placed{};
    std::function<void()> rested{};  ///< the eye has not moved for a while
  };

  explicit Canvas(QWidget* parent = nullptr);
  ~Canvas() override;

  void set_hooks(Hooks hooks) { hooks_ = std::move(hooks); }
  View& view() noexcept { return *view_; }

  /// Schedules a redraw; requests made before it are combined.
  void draw();
  /// Moves the eye, with reduced detail until it rests; schedules a redraw.
  void look(const Look& look);
  /// Makes the next press and release of the mouse define a position and a direction, not a
  /// rotation.
  void take_place(bool on);
  bool is_moving() const noexcept { return is_moving_; }
  bool is_taking_place() const noexcept { return taking_place_; }

  /// Returns the frame rate of the last frames drawn while moving; 0 if there are none.
  double frames_per_s() const;

 protected:
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  struct Press {
    QPoint at, last;
    Qt::MouseButton button = Qt::NoButton;
    Qt::KeyboardModifiers keys;
    bool is_drag = false;
  };

  void draw_now();
  void drag(const Press& press, QPoint step);
  void fly();
  glm::ivec2 pixel_of(QPoint place) const;
  double height_px() const;

  vtkSmartPointer<vtkRenderWindow> window_;
  std::unique_ptr<View> view_;
  Hooks hooks_;
  std::optional<Press> press_;
  std::set<int> keys_down_;  // flight keys that are held down
  bool taking_place_ = false;
  bool is_moving_ = false;
  QTimer soon_, rest_, flight_;
  std::deque<double> drawn_s_;  // drawing times of the last frames
};

}  // namespace groundray
