#include "apps/view/window/panels/compare_panel.h"

#include <fmt/format.h>

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>

#include "apps/view/window/panels/histogram_plot.h"
#include "apps/view/window/style.h"
#include "core/error.h"

namespace groundray {
namespace {

FactTable::Facts facts_of(const Comparison& comparison) {
  const DeviationFigures& figures = comparison.deviation.figures;
  const auto metres = [](double value) { return fmt::format("{:.4g} m", value); };
  FactTable::Facts facts{{"points", fmt::format("{}", figures.count)},
                         {"beyond the truth", fmt::format("{}", figures.beyond)},
                         {"mean", metres(figures.mean_m)},
                         {"RMS", metres(figures.rms_m)},
                         {"median", metres(figures.median_m)},
                         {"NMAD", metres(figures.nmad_m)},
                         {"95 % within", metres(figures.p95_m)},
                         {"largest", metres(figures.largest_m)},
                         {"lowest", metres(figures.low_m)},
                         {"highest", metres(figures.high_m)}};
  for (const std::string& line : agreement_lines(comparison.agreements)) {
    facts.emplace_back("surfaces", line);
  }
  return facts;
}

// Refills a box and keeps its selection.
void fill(QComboBox& box, const std::vector<std::string>& names) {
  const QString before = box.currentText();
  box.clear();
  for (const std::string& name : names) box.addItem(QString::fromStdString(name));
  const int index = box.findText(before);
  if (index >= 0) box.setCurrentIndex(index);
}

}  // namespace

ComparePanel::ComparePanel(Hooks hooks, QWidget* parent)
    : QWidget(parent), hooks_(std::move(hooks)) {
  build();
  connect(compare_, &QPushButton::clicked, this, [this] { compare_chosen(); });
  connect(cancel_, &QPushButton::clicked, this, [this] { cancel(); });
  update_buttons();
}

void ComparePanel::build() {
  layer_ = new QComboBox;
  layer_->setObjectName("measured");
  truth_ = new QComboBox;
  truth_->setObjectName("truth");
  for (QComboBox* box : {layer_, truth_}) {
    box->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    box->setMinimumContentsLength(16);
  }
  tolerance_ = new QDoubleSpinBox;
  tolerance_->setRange(0, 1e6);
  tolerance_->setDecimals(4);
  tolerance_->setSuffix(" m");
  tolerance_->setSpecialValueText("none");
  tolerance_->setToolTip("Distance for the precision and completeness of two surfaces");
  compare_ = new QPushButton("Compare");
  compare_->setObjectName("compare");
  cancel_ = new QPushButton("Cancel");
  progress_ = new QProgressBar;
  progress_->setRange(0, progress_steps);
  title_ = new QLabel;
  title_->setWordWrap(true);
  plot_ = new HistogramPlot;
  figures_ = new FactTable;
  auto* form = new QFormLayout;
  form->addRow("Measured", layer_);
  form->addRow("Truth", truth_);
  form->addRow("Tolerance", tolerance_);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(compare_);
  buttons->addWidget(cancel_);
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(form);
  layout->addLayout(buttons);
  layout->addWidget(progress_);
  layout->addWidget(title_);
  layout->addWidget(plot_, 1);
  layout->addWidget(figures_, 1);
}

void ComparePanel::offer(const std::vector<std::string>& layers, std::vector<Truth> truths) {
  truths_ = std::move(truths);
  std::vector<std::string> names(truths_.size());
  std::ranges::transform(truths_, names.begin(), &Truth::name);
  fill(*layer_, layers);
  fill(*truth_, names);
  update_buttons();
}

void ComparePanel::choose(const std::string& layer, const std::string& truth) {
  for (const auto& [box, name] : {std::pair(layer_, layer), {truth_, truth}}) {
    const int index = box->findText(QString::fromStdString(name));
    if (index >= 0) box->setCurrentIndex(index);
  }
}

void ComparePanel::update_buttons() {
  compare_->setEnabled(layer_->count() > 0 && !truths_.empty() && !is_comparing());
  cancel_->setEnabled(is_comparing());
  progress_->setVisible(is_comparing());
}

// Takes the present data of a displayed surface, which may have changed since it was offered:
// terrain follows the eye.
Truth ComparePanel::chosen_truth(std::size_t index) const {
  Truth truth = truths_[index];
  if (const auto* offered = std::get_if<Layer>(&truth.what)) {
    const Layer* shown = hooks_.layer(offered->name);
    if (shown == nullptr) throw Error("{}: it is not shown any more", truth.name);
    truth.what = Layer(*shown);
  }
  return truth;
}

void ComparePanel::compare_chosen() {
  const Layer* layer = hooks_.layer(layer_->currentText().toStdString());
  const int index = truth_->currentIndex();
  if (layer == nullptr || index < 0 || is_comparing()) return;
  Truth truth;
  try {
    truth = chosen_truth(static_cast<std::size_t>(index));
  } catch (const Error& error) {
    if (hooks_.failed) hooks_.failed(error.what());
    return;
  }
  const auto work = [measured = *layer, truth, tolerance_m = tolerance_->value()](
                        const std::stop_token& stop, const Told& told) {
    return compare(measured, truth, tolerance_m, stop, [&](double share) { told(share, ""); });
  };
  progress_->setValue(0);
  title_->clear();
  job_.start(work,
             [this, measured = *layer](const Comparison& comparison) {
               show_comparison(comparison);
               if (hooks_.compared) hooks_.compared(comparison, measured);
             },
             {.told =
                  [this](double share, const std::string&) {
                    progress_->setValue(static_cast<int>(share * progress_steps));
                  },
              .failed = hooks_.failed,
              .cancelled = [this] { title_->setText("cancelled"); },
              .ended = [this] { update_buttons(); }});
  update_buttons();
}

void ComparePanel::show_comparison(const Comparison& comparison) {
  title_->setText(
      QString::fromStdString(fmt::format("{}  against  {}", comparison.layer, comparison.truth)));
  const double end_m = comparison.deviation.figures.p95_m;
  const double colours_m = end_m > 0 ? end_m : 1;
  plot_->show_histogram(comparison.histogram, {-colours_m, colours_m});
  figures_->show_facts(facts_of(comparison));
}

}  // namespace groundray
