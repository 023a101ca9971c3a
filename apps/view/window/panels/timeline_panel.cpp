#include "apps/view/window/panels/timeline_panel.h"

#include <fmt/format.h>

#include <QCheckBox>
#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>
#include <algorithm>
#include <array>

#include "apps/view/window/style.h"
#include "apps/view/window/widgets.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;
constexpr int tick_ms = 40;
constexpr std::int64_t slider_step_ns = 1'000'000;
constexpr std::array<double, 7> speeds{0.1, 0.25, 0.5, 1, 2, 4, 10};
constexpr int speed_at_first = 3;
constexpr int row_px = 14;
constexpr int strip_margin_px = 6;

double seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

QColor sensor_colour(std::size_t sensor) {
  return QColor::fromHsv(static_cast<int>((200 + sensor * 67) % 360), 150, 230);
}

}  // namespace

// Timeline with a line for each sensor of a dataset, a mark for each frame and a bar at the
// current time; a press goes to the time at the mouse.
class EventStrip : public QWidget {
 public:
  explicit EventStrip(std::function<void(std::chrono::nanoseconds)> chosen,
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

  std::function<void(std::chrono::nanoseconds)> chosen_;
  std::shared_ptr<const Timeline> timeline_;
  std::chrono::nanoseconds time_{0};
};

EventStrip::EventStrip(std::function<void(std::chrono::nanoseconds)> chosen, QWidget* parent)
    : QWidget(parent), chosen_(std::move(chosen)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setCursor(Qt::SizeHorCursor);
}

void EventStrip::show_timeline(std::shared_ptr<const Timeline> timeline) {
  timeline_ = std::move(timeline);
  updateGeometry();
  update();
}

void EventStrip::set_time(std::chrono::nanoseconds time) {
  time_ = time;
  update();
}

QSize EventStrip::sizeHint() const {
  const int rows = timeline_ == nullptr ? 1 : static_cast<int>(timeline_->sensors().size());
  return {200, std::clamp(rows, 1, 12) * row_px + 4};
}

int EventStrip::names_width() const {
  int width = 0;
  if (timeline_ == nullptr) return width;
  for (const RecordedSensor& sensor : timeline_->sensors()) {
    width = std::max(width, fontMetrics().horizontalAdvance(QString::fromStdString(sensor.name)));
  }
  return width + 2 * strip_margin_px;
}

double EventStrip::x_of(std::chrono::nanoseconds time) const {
  const double span = static_cast<double>((timeline_->end() - timeline_->begin()).count());
  const double share =
      span > 0 ? static_cast<double>((time - timeline_->begin()).count()) / span : 0;
  return names_width() + share * (width() - names_width() - strip_margin_px);
}

void EventStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().base());
  if (timeline_ == nullptr) return;
  for (std::size_t i = 0; i < timeline_->sensors().size(); ++i) {
    const int top = 2 + static_cast<int>(i) * row_px;
    const RecordedSensor& sensor = timeline_->sensors()[i];
    painter.setPen(palette().text().color());
    painter.drawText(QRect(strip_margin_px, top, names_width(), row_px), Qt::AlignVCenter,
                     QString::fromStdString(sensor.name));
    painter.setPen(palette().mid().color());
    painter.drawLine(names_width(), top + row_px / 2, width() - strip_margin_px, top + row_px / 2);
    const auto current = timeline_->current(i, time_);
    double last_x = -1;
    for (std::size_t k = 0; k < sensor.frames.size(); ++k) {
      const double x = x_of(sensor.frames[k].stamp);
      const bool is_current = current == k;
      if (x < last_x + 1 && !is_current) continue;  // a second mark on the same pixel
      last_x = x;
      painter.fillRect(
          QRectF(x - (is_current ? 1.5 : 0.5), top + 2, is_current ? 4 : 2, row_px - 4),
          is_current ? QColor(Qt::white) : sensor_colour(i));
    }
  }
  painter.fillRect(QRectF(x_of(time_) - 0.5, 0, 1.5, height()), QColor(255, 140, 40));
}

void EventStrip::go(int x) {
  if (timeline_ == nullptr || !chosen_) return;
  const int room = width() - names_width() - strip_margin_px;
  const double share =
      room > 0 ? std::clamp(static_cast<double>(x - names_width()) / room, 0.0, 1.0) : 0;
  const double span = static_cast<double>((timeline_->end() - timeline_->begin()).count());
  chosen_(timeline_->begin() + std::chrono::nanoseconds(static_cast<std::int64_t>(share * span)));
}

void EventStrip::mousePressEvent(QMouseEvent* event) { go(event->x()); }

void EventStrip::mouseMoveEvent(QMouseEvent* event) {
  if ((event->buttons() & Qt::LeftButton) != 0) go(event->x());
}

TimelinePanel::TimelinePanel(Hooks hooks, QWidget* parent)
    : QWidget(parent), hooks_(std::move(hooks)) {
  strip_ = new EventStrip([this](nanoseconds time) { go_to(time); });
  slider_ = named(new QSlider(Qt::Horizontal), "time");
  connect(slider_, &QSlider::valueChanged, this, [this](int step) {
    if (timeline_ != nullptr) go_to(timeline_->begin() + nanoseconds(step * slider_step_ns));
  });
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->setSpacing(4);
  add_widgets(*layout, {build_buttons(), slider_, strip_});
  layout->addStretch(1);
  for (QCheckBox* box : {rides_, trail_}) {
    connect(box, &QCheckBox::toggled, this, [this] {
      if (hooks_.options_changed) hooks_.options_changed();
    });
  }
  clock_.setInterval(tick_ms);
  connect(&clock_, &QTimer::timeout, this, [this] { tick(); });
  setEnabled(false);
}

QToolButton* TimelinePanel::button(const char* name, const char* tip, Icon icon,
                                   std::function<void()> pressed) {
  auto* made = named(new QToolButton, name, tip);
  made->setIcon(icon_of(icon));
  made->setAutoRaise(true);
  connect(made, &QToolButton::clicked, this, std::move(pressed));
  return made;
}

QWidget* TimelinePanel::build_buttons() {
  auto* row = new QWidget;
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  QToolButton* back =
      button("step_back", "Previous frame ( , )", Icon::Back, [this] { step_back(); });
  play_ = button("play", "Play and pause (Space)", Icon::Play, [this] { play(!is_playing()); });
  QToolButton* forward =
      button("step_forward", "Next frame ( . )", Icon::Forward, [this] { step_forward(); });
  speed_ = named(new QComboBox, "speed", "Playback speed: seconds of the run per second");
  for (const double speed : speeds) speed_->addItem(text_of("{} x", speed), speed);
  speed_->setCurrentIndex(speed_at_first);
  sensor_ = named(new QComboBox, "stepped_sensor", "Sensor whose frames the steps go through");
  sensor_->setSizeAdjustPolicy(QComboBox::AdjustToContents);
  label_ = named(new QLabel, "time_label");
  rides_ = named(new QCheckBox("Ride along"), "rides", "The view moves with the platform");
  trail_ = new QCheckBox("Trail");
  trail_->setChecked(true);
  add_widgets(*layout, {back, play_, forward, speed_, sensor_, rides_, trail_});
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
  if (hooks_.time_changed) hooks_.time_changed(time_);
}

void TimelinePanel::show_time() {
  const QSignalBlocker quiet(slider_);
  slider_->setValue(static_cast<int>((time_ - timeline_->begin()).count() / slider_step_ns));
  strip_->set_time(time_);
  label_->setText(text_of("{:.3f} of {:.3f} s", seconds(time_), seconds(timeline_->end())));
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
  play_->setIcon(icon_of(on ? Icon::Pause : Icon::Play));
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
