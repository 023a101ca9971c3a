#include "apps/view/window/panels/timeline_panel.h"

#include <fmt/format.h>

#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>
#include <algorithm>
#include <array>

#include "apps/view/window/panels/event_strip.h"
#include "apps/view/window/style.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;
constexpr int tick_ms = 40;
constexpr std::int64_t slider_step_ns = 1'000'000;
constexpr std::array<double, 7> speeds{0.1, 0.25, 0.5, 1, 2, 4, 10};
constexpr int speed_at_first = 3;

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

TimelinePanel::TimelinePanel(Hooks hooks, QWidget* parent)
    : QWidget(parent), hooks_(std::move(hooks)) {
  strip_ = new EventStrip([this](nanoseconds time) { go_to(time); });
  slider_ = new QSlider(Qt::Horizontal);
  slider_->setObjectName("time");
  connect(slider_, &QSlider::valueChanged, this, [this](int step) {
    if (timeline_ != nullptr) go_to(timeline_->begin() + nanoseconds(step * slider_step_ns));
  });
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->setSpacing(4);
  layout->addWidget(build_buttons());
  layout->addWidget(slider_);
  layout->addWidget(strip_);
  layout->addStretch(1);
  for (QCheckBox* box : {rides_, trail_}) {
    connect(box, &QCheckBox::toggled, this, [this] {
      if (hooks_.asked) hooks_.asked();
    });
  }
  clock_.setInterval(tick_ms);
  connect(&clock_, &QTimer::timeout, this, [this] { tick(); });
  setEnabled(false);
}

QToolButton* TimelinePanel::button(const QString& name, const QString& tip,
                                   std::function<void()> pressed) {
  auto* made = new QToolButton;
  made->setObjectName(name);
  made->setToolTip(tip);
  made->setAutoRaise(true);
  connect(made, &QToolButton::clicked, this, std::move(pressed));
  return made;
}

QWidget* TimelinePanel::build_buttons() {
  auto* row = new QWidget;
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  QToolButton* back = button("step_back", "Previous frame ( , )", [this] { step_back(); });
  back->setIcon(icon_of(Sign::Back));
  play_ = button("play", "Play and pause (Space)", [this] { play(!is_playing()); });
  play_->setIcon(icon_of(Sign::Play));
  QToolButton* forward = button("step_forward", "Next frame ( . )", [this] { step_forward(); });
  forward->setIcon(icon_of(Sign::Forward));
  speed_ = new QComboBox;
  for (const double speed : speeds) {
    speed_->addItem(QString::fromStdString(fmt::format("{} x", speed)), speed);
  }
  speed_->setCurrentIndex(speed_at_first);
  speed_->setToolTip("Playback speed: seconds of the run per second");
  sensor_ = new QComboBox;
  sensor_->setSizeAdjustPolicy(QComboBox::AdjustToContents);
  sensor_->setToolTip("Sensor whose frames the steps go through");
  label_ = new QLabel;
  label_->setObjectName("time_label");
  rides_ = new QCheckBox("Ride along");
  rides_->setObjectName("rides");
  rides_->setToolTip("The view moves with the platform");
  trail_ = new QCheckBox("Trail");
  trail_->setChecked(true);
  for (QWidget* each : std::initializer_list<QWidget*>{back, play_, forward}) {
    layout->addWidget(each);
  }
  layout->addWidget(speed_);
  layout->addWidget(sensor_);
  layout->addWidget(rides_);
  layout->addWidget(trail_);
  layout->addStretch(1);
  layout->addWidget(label_);
  return row;
}

void TimelinePanel::show_timeline(std::shared_ptr<const Timeline> timeline) {
  play(false);
  timeline_ = std::move(timeline);
  setEnabled(timeline_ != nullptr);
  strip_->show_timeline(timeline_);
  sensor_->clear();
  sensor_->addItem("all sensors");
  if (timeline_ == nullptr) return;
  for (const RecordedSensor& sensor : timeline_->sensors()) {
    sensor_->addItem(QString::fromStdString(sensor.name));
  }
  const nanoseconds span = timeline_->end() - timeline_->begin();
  {
    const QSignalBlocker quiet(slider_);
    slider_->setRange(0, static_cast<int>((span.count() + slider_step_ns - 1) / slider_step_ns));
  }
  time_ = timeline_->begin();
  go_to(time_);
}

std::optional<std::size_t> TimelinePanel::chosen_sensor() const {
  const int index = sensor_->currentIndex();
  return index < 1 ? std::nullopt : std::optional(static_cast<std::size_t>(index - 1));
}

void TimelinePanel::go_to(nanoseconds time) {
  if (timeline_ == nullptr) return;
  time_ = std::clamp(time, timeline_->begin(), timeline_->end());
  show_time();
  if (hooks_.went) hooks_.went(time_);
}

void TimelinePanel::show_time() {
  const QSignalBlocker quiet(slider_);
  slider_->setValue(static_cast<int>((time_ - timeline_->begin()).count() / slider_step_ns));
  strip_->set_time(time_);
  label_->setText(QString::fromStdString(
      fmt::format("{:.3f} of {:.3f} s", seconds(time_), seconds(timeline_->end()))));
}

void TimelinePanel::step_forward() {
  if (timeline_ == nullptr) return;
  if (const auto next = timeline_->next(time_, chosen_sensor())) go_to(*next);
}

void TimelinePanel::step_back() {
  if (timeline_ == nullptr) return;
  if (const auto before = timeline_->previous(time_, chosen_sensor())) go_to(*before);
}

void TimelinePanel::play(bool on) {
  if (timeline_ == nullptr) on = false;
  if (on && time_ >= timeline_->end()) go_to(timeline_->begin());
  play_->setIcon(icon_of(on ? Sign::Pause : Sign::Play));
  if (on) {
    since_tick_.start();
    clock_.start();
  } else {
    clock_.stop();
  }
}

void TimelinePanel::tick() {
  const double passed_ns =
      static_cast<double>(since_tick_.nsecsElapsed()) * speed_->currentData().toDouble();
  since_tick_.start();
  go_to(time_ + nanoseconds(static_cast<std::int64_t>(passed_ns)));
  if (time_ >= timeline_->end()) play(false);
}

bool TimelinePanel::rides_along() const { return rides_->isChecked(); }
bool TimelinePanel::shows_trail() const { return trail_->isChecked(); }

}  // namespace groundray
