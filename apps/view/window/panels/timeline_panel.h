#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <QWidget>
#include <chrono>
#include <functional>
#include <memory>

#include "apps/view/recorded/timeline.h"
#include "apps/view/window/style.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QSlider;
class QToolButton;

namespace groundray {

class EventStrip;

/// Panel for the time in a dataset: slider, steps and playback.
class TimelinePanel : public QWidget {
 public:
  struct Hooks {
    std::function<void(std::chrono::nanoseconds)> time_changed{};  ///< the time has changed
    std::function<void()> options_changed{};  ///< "ride along" or "trail" has changed
  };

  explicit TimelinePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Shows a dataset's time span and goes to its start; null for none.
  void show_timeline(std::shared_ptr<const Timeline> timeline);
  const Timeline* timeline() const noexcept { return timeline_.get(); }

  std::chrono::nanoseconds time() const noexcept { return time_; }
  /// Goes to a time, clamped to the time span.
  void go_to(std::chrono::nanoseconds time);
  /// Goes to the next or previous frame, of the selected sensor or of any.
  void step_forward();
  void step_back();
  void play(bool on);
  bool is_playing() const { return clock_.isActive(); }

  bool rides_along() const;  ///< true if the view moves with the platform
  bool shows_trail() const;

 private:
  QWidget* build_buttons();
  QToolButton* button(const char* name, const char* tip, Icon icon, std::function<void()> pressed);
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
