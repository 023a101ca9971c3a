#include "apps/view/window/panels/clip_panel.h"

#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

#include "apps/view/window/widgets.h"

namespace groundray {
namespace {

constexpr std::array axis_names{"east", "north", "up"};
constexpr int decimals = 3;
constexpr double step = 1e-3;  // the boxes' last digit

QDoubleSpinBox* limit_box(const QString& name) {
  auto* box = new QDoubleSpinBox;
  box->setObjectName(name);
  box->setDecimals(decimals);
  box->setRange(-1e12, 1e12);
  box->setSuffix(" m");
  box->setKeyboardTracking(false);
  box->setMinimumWidth(90);  // the widest number would take half of the window
  box->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  return box;
}

}  // namespace

ClipPanel::ClipPanel(Hooks hooks, QWidget* parent) : QWidget(parent), hooks_(std::move(hooks)) {
  build();
  connect(on_, &QCheckBox::toggled, this, [this](bool on) {
    if (on && !has_box_) return reset();
    report();
  });
  connect(reset_, &QPushButton::clicked, this, [this] { reset(); });
  for (std::size_t k = 0; k < 3; ++k) {
    for (QDoubleSpinBox* box : {low_[k], high_[k]}) {
      connect(box, qOverload<double>(&QDoubleSpinBox::valueChanged), this, [this] {
        if (!is_filling_) report();
      });
    }
  }
}

void ClipPanel::build() {
  on_ = named(new QCheckBox("Show only what is inside the box"), "clip");
  reset_ = named(new QPushButton("Reset"), "clip_reset", "Extend the box to everything shown");
  auto* grid = new QGridLayout;
  for (std::size_t k = 0; k < 3; ++k) {
    const int row = static_cast<int>(k);
    low_[k] = limit_box(QString("clip_low_") + axis_names[k]);
    high_[k] = limit_box(QString("clip_high_") + axis_names[k]);
    grid->addWidget(new QLabel(axis_names[k]), row, 0);
    grid->addWidget(low_[k], row, 1);
    grid->addWidget(new QLabel("to"), row, 2);
    grid->addWidget(high_[k], row, 3);
  }
  grid->setColumnStretch(1, 1);
  grid->setColumnStretch(3, 1);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(on_);
  layout->addLayout(grid);
  layout->addWidget(reset_);
  layout->addWidget(wrapped_label(
      "Coordinates are those of the map. A layer is exempt if \"Clipped by the box\" is off in "
      "its settings."));
  layout->addStretch(1);
}

bool ClipPanel::is_on() const { return on_->isChecked(); }

void ClipPanel::fill(const ClipBox& box) {
  is_filling_ = true;
  has_box_ = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<glm::length_t>(k);
    low_[k]->setSingleStep(std::max(step, (box.high_w_m[axis] - box.low_w_m[axis]) / 50));
    high_[k]->setSingleStep(low_[k]->singleStep());
    low_[k]->setValue(box.low_w_m[axis]);
    high_[k]->setValue(box.high_w_m[axis]);
  }
  is_filling_ = false;
}

void ClipPanel::set_box(const ClipBox& box) {
  fill(box);
  on_->setChecked(true);
  report();
}

void ClipPanel::reset() {
  if (const auto bounds = hooks_.bounds()) {
    ClipBox box = *bounds;  // outwards to the boxes' digits
    for (glm::length_t k = 0; k < 3; ++k) {
      box.low_w_m[k] = (std::floor(box.low_w_m[k] / step) - 1) * step;
      box.high_w_m[k] = (std::ceil(box.high_w_m[k] / step) + 1) * step;
    }
    fill(box);
  }
  report();
}

// Limits that are swapped or equal leave the box as it is until they are mended.
void ClipPanel::report() {
  if (!is_on() || !has_box_) return hooks_.changed(std::nullopt);
  ClipBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<glm::length_t>(k);
    box.low_w_m[axis] = low_[k]->value();
    box.high_w_m[axis] = high_[k]->value();
    if (!(box.low_w_m[axis] < box.high_w_m[axis])) return;
  }
  hooks_.changed(box);
}

}  // namespace groundray
