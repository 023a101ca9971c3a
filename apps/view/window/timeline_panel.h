#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <QWidget>
#include <chrono>
#include <functional>
#include <memory>

#include "apps/view/timeline.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QSlider;
class QToolButton;

namespace groundray {

class EventStrip;

/// Where in a dataset's time the window is: to slide, step and play.
class TimelinePanel : public QWidget {
 public:
  struct Hooks {
    std::function<void(std::chrono::nanoseconds)> went{};  ///< to a time
    std::function<void()> asked{};  ///< what is shown along the way is to be another
  };

  explicit TimelinePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Shows a dataset's time and goes to its begin; null for none.
  void show_timeline(std::shared_ptr<const Timeline> timeline);
  const Timeline* timeline() const noexcept { return timeline_.get(); }

  std::chrono::nanoseconds time() const noexcept { return time_; }
  /// Goes to a time, or to the nearest end.
  void go_to(std::chrono::nanoseconds time);
  /// Goes to the next frame, or the one before: of the sensor that is chosen, or of any.
  void step_forward();
  void step_back();
  void play(bool on);
  bool is_playing() const { return clock_.isActive(); }

  bool rides_along() const;  ///< the view moves with the platform
  bool shows_trail() const;

 private:
  QWidget* build_buttons();
  QToolButton* button(const QString& name, const QString& tip, std::function<void()> pressed);
  void tick();
  std::optional<std::size_t> chosen_sensor() const;
  void show_time();

  Hooks hooks_;
  std::shared_ptr<const Timeline> timeline_;
  std::chrono::nanoseconds time_{0};
  QTimer clock_;
  QElapsedTimer since_tick_;
  EventStrip* strip_ = nullptr;
  QSlider* slider_ = nullptr;
  QLabel* label_ = nullptr;
  QToolButton* play_ = nullptr;
  QComboBox *speed_ = nullptr, *sensor_ = nullptr;
  QCheckBox *rides_ = nullptr, *trail_ = nullptr;
};

}  // namespace groundray
