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

#include "apps/view/view.h"

namespace groundray {

/// The view in the window: it is turned, moved and clicked into with the mouse and by keys.
class Canvas : public QVTKOpenGLNativeWidget {
 public:
  /// What is called as it is used; any may be empty. Pixels are the view's.
  struct Hooks {
    std::function<void(glm::ivec2 at_px, Qt::KeyboardModifiers)> clicked{};
    /// With `take_place`: pressed at one pixel, let go at another.
    std::function<void(glm::ivec2 at_px, glm::ivec2 towards_px)> placed{};
    std::function<void()> moving{};  ///< the eye has moved, and may go on
    std::function<void()> rested{};  ///< it has not moved for a while
  };

  explicit Canvas(QWidget* parent = nullptr);
  ~Canvas() override;

  void set_hooks(Hooks hooks) { hooks_ = std::move(hooks); }
  View& view() noexcept { return *view_; }

  /// Draws soon: once for all that asked till then.
  void draw();
  /// Looks from elsewhere, as one who moves; drawn soon.
  void look(const Look& look);
  /// The next press and release of the mouse are a place and a direction, not a turn.
  void take_place(bool on);
  bool is_moving() const noexcept { return is_moving_; }
  bool is_taking_place() const noexcept { return taking_place_; }

  /// Returns how many pictures a second drawing gives while moving: of the last ones; none yet, 0.
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
  std::set<int> keys_down_;  // of those that fly
  bool taking_place_ = false;
  bool is_moving_ = false;
  QTimer soon_, rest_, flight_;
  std::deque<double> drawn_s_;  // how long the last pictures took
};

}  // namespace groundray
