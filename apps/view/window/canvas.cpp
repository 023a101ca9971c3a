#include "apps/view/window/canvas.h"

#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkNew.h>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QWheelEvent>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <numeric>

#include "apps/view/window/orbit.h"
#include "apps/view/window/style.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int rest_ms = 250;
constexpr int flight_ms = 16;
constexpr double turn_rad_px = 0.006;
constexpr double zoom_step = 0.85;
constexpr double key_turn_rad = std::numbers::pi / 36;
constexpr std::size_t timed_pictures = 20;

// Directions of flight: ahead, right, up.
const std::map<int, glm::dvec3>& flying_keys() {
  static const std::map<int, glm::dvec3> keys{{Qt::Key_W, {1, 0, 0}}, {Qt::Key_S, {-1, 0, 0}},
                                              {Qt::Key_D, {0, 1, 0}}, {Qt::Key_A, {0, -1, 0}},
                                              {Qt::Key_E, {0, 0, 1}}, {Qt::Key_Q, {0, 0, -1}}};
  return keys;
}

double view_angle_rad(const View& view) {
  return view.renderer()->GetActiveCamera()->GetViewAngle() * std::numbers::pi / 180;
}

}  // namespace

Canvas::Canvas(QWidget* parent) : QVTKOpenGLNativeWidget(parent) {
  const vtkNew<vtkGenericOpenGLRenderWindow> window;
  setRenderWindow(window);
  interactor()->SetInteractorStyle(nullptr);  // this class handles the mouse itself
  window_ = window;
  view_ = std::make_unique<View>(window_);
  setFocusPolicy(Qt::StrongFocus);
  setMinimumSize(200, 150);
  soon_.setSingleShot(true);
  rest_.setSingleShot(true);
  rest_.setInterval(rest_ms);
  flight_.setInterval(flight_ms);
  connect(&soon_, &QTimer::timeout, this, [this] { draw_now(); });
  connect(&flight_, &QTimer::timeout, this, [this] { fly(); });
  connect(&rest_, &QTimer::timeout, this, [this] {
    is_moving_ = false;
    view_->set_moving(false);
    draw();
    if (hooks_.rested) hooks_.rested();
  });
}

Canvas::~Canvas() {
  makeCurrent();  // the view releases its OpenGL resources
  view_.reset();
}

void Canvas::draw() {
  if (!soon_.isActive()) soon_.start(0);
}

void Canvas::draw_now() {
  const auto begin = std::chrono::steady_clock::now();
  view_->render();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (!is_moving_) return;
  drawn_s_.push_back(took.count());
  if (drawn_s_.size() > timed_pictures) drawn_s_.pop_front();
}

double Canvas::frames_per_s() const {
  const double total_s = std::accumulate(drawn_s_.begin(), drawn_s_.end(), 0.0);
  return total_s > 0 ? static_cast<double>(drawn_s_.size()) / total_s : 0;
}

void Canvas::look(const Look& look) {
  if (!is_moving_) {
    is_moving_ = true;
    drawn_s_.clear();
    view_->set_moving(true);
  }
  view_->look(look);
  rest_.start();
  draw();
}

void Canvas::take_place(bool on) {
  taking_place_ = on;
  setCursor(on ? Qt::CrossCursor : Qt::ArrowCursor);
}

glm::ivec2 Canvas::pixel_of(QPoint place) const {
  const double ratio = devicePixelRatioF();
  return {static_cast<int>(std::lround(place.x() * ratio)),
          static_cast<int>(std::lround(place.y() * ratio))};
}

double Canvas::height_px() const { return std::max(1, height()); }

void Canvas::mousePressEvent(QMouseEvent* event) {
  setFocus();
  press_ = Press{event->pos(), event->pos(), event->button(), event->modifiers(), false};
}

void Canvas::mouseMoveEvent(QMouseEvent* event) {
  if (!press_) return;
  const QPoint place = event->pos();
  press_->is_drag = press_->is_drag || (place - press_->at).manhattanLength() >= drag_begins_px;
  if (!press_->is_drag || (taking_place_ && press_->button == Qt::LeftButton)) return;
  drag(*press_, place - press_->last);
  press_->last = place;
}

void Canvas::mouseReleaseEvent(QMouseEvent* event) {
  if (!press_ || event->button() != press_->button) return;
  const Press press = *press_;
  press_.reset();
  if (press.button != Qt::LeftButton) return;
  if (taking_place_) {
    take_place(false);
    if (hooks_.placed) hooks_.placed(pixel_of(press.at), pixel_of(event->pos()));
  } else if (!press.is_drag && hooks_.clicked) {
    hooks_.clicked(pixel_of(press.at), press.keys);
  }
}

// Makes the point under a double click the centre of rotation.
void Canvas::mouseDoubleClickEvent(QMouseEvent* event) {
  const glm::ivec2 at_px = pixel_of(event->pos());
  if (const auto picked = view_->pick(at_px.x, at_px.y)) {
    const Look before = view_->current_look();
    const glm::dvec3 shift_m = picked->p_w_m - before.at_w_m;
    look({before.from_w_m + shift_m, picked->p_w_m, before.up});
  }
}

// The left button rotates, Shift + left or the middle button pans, the right button zooms.
void Canvas::drag(const Press& press, QPoint step) {
  const Look before = view_->current_look();
  const bool pans = press.button == Qt::MiddleButton || (press.keys & Qt::ShiftModifier) != 0;
  if (press.button == Qt::RightButton) {
    look(zoomed(before, math::exp(0.01 * step.y()), before.at_w_m));
  } else if (pans) {
    const double pixel_m = metres_per_pixel(before, view_angle_rad(*view_), height_px());
    look(panned(before, -step.x() * pixel_m, step.y() * pixel_m));
  } else {
    look(orbited(before, -step.x() * turn_rad_px, step.y() * turn_rad_px));
  }
}

void Canvas::wheelEvent(QWheelEvent* event) {
  const Look before = view_->current_look();
  const double steps = event->angleDelta().y() / 120.0;
  const glm::ivec2 at_px = pixel_of(event->position().toPoint());
  const auto [eye, direction] = view_->line_of_sight(at_px.x, at_px.y);
  const glm::dvec3 ahead = glm::normalize(before.at_w_m - before.from_w_m);
  const double slant = glm::dot(direction, ahead);
  const glm::dvec3 towards =
      slant > 0.01
          ? before.from_w_m + direction * (glm::distance(before.at_w_m, before.from_w_m) / slant)
          : before.at_w_m;
  look(zoomed(before, math::pow(zoom_step, steps), towards));
  event->accept();
}

void Canvas::keyPressEvent(QKeyEvent* event) {
  const Look before = view_->current_look();
  switch (event->key()) {
    case Qt::Key_Left:
      return look(orbited(before, -key_turn_rad, 0));
    case Qt::Key_Right:
      return look(orbited(before, key_turn_rad, 0));
    case Qt::Key_Up:
      return look(orbited(before, 0, key_turn_rad));
    case Qt::Key_Down:
      return look(orbited(before, 0, -key_turn_rad));
    case Qt::Key_Plus:
    case Qt::Key_PageUp:
      return look(zoomed(before, zoom_step, before.at_w_m));
    case Qt::Key_Minus:
    case Qt::Key_PageDown:
      return look(zoomed(before, 1 / zoom_step, before.at_w_m));
    case Qt::Key_Escape:
      return take_place(false);
    default:
      break;
  }
  if (!flying_keys().contains(event->key()) || event->modifiers() != Qt::NoModifier) {
    return QWidget::keyPressEvent(event);
  }
  if (event->isAutoRepeat()) return;
  keys_down_.insert(event->key());
  flight_.start();
  fly();
}

void Canvas::keyReleaseEvent(QKeyEvent* event) {
  if (event->isAutoRepeat()) return;
  keys_down_.erase(event->key());
  if (keys_down_.empty()) flight_.stop();
}

void Canvas::focusOutEvent(QFocusEvent* event) {
  keys_down_.clear();
  flight_.stop();
  QVTKOpenGLNativeWidget::focusOutEvent(event);
}

// Flies half the distance to the target per second.
void Canvas::fly() {
  const Look before = view_->current_look();
  const double step_m = glm::distance(before.at_w_m, before.from_w_m) * 0.5 * flight_ms / 1000;
  glm::dvec3 way(0);
  for (const int key : keys_down_) way += flying_keys().at(key);
  look(flown(before, way * step_m));
}

void Canvas::resizeEvent(QResizeEvent* event) {
  QVTKOpenGLNativeWidget::resizeEvent(event);
  draw();
}

}  // namespace groundray
