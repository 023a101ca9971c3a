#include "apps/view/window/panels/compare_panel.h"

#include <fmt/format.h>

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "apps/view/rendering/colour_table.h"
#include "apps/view/window/style.h"
#include "apps/view/window/widgets.h"
#include "core/error.h"

namespace groundray {
namespace {

constexpr int plot_margin_px = 8;
constexpr int axis_ticks = 5;

FactTable::Facts facts_of(const Comparison& comparison) {
  FactTable::Facts facts = figure_texts(comparison.deviation.figures);
  for (const std::string& line : agreement_lines(comparison.agreements)) {
    facts.emplace_back("surfaces", line);
  }
  return facts;
}

// Refills a box and keeps its selection.
// Fills a box with names and numbers; keeps the selection if the user has made it.
void fill(QComboBox& box, const std::vector<std::pair<std::string, int>>& names, bool is_chosen) {
  const QSignalBlocker blocker(box);
  const QString before = box.currentText();
  box.clear();
  for (const auto& [name, number] : names) box.addItem(QString::fromStdString(name), number);
  const int index = is_chosen ? box.findText(before) : -1;
  if (index >= 0) box.setCurrentIndex(index);
}

}  // namespace

// Histogram of deviations, in the colours of the surface.
class HistogramPlot : public QWidget {
 public:
  explicit HistogramPlot(QWidget* parent = nullptr);

  // @param colours_m  deviations at the ends of the colours, m.
  void show_histogram(std::optional<DeviationHistogram> histogram, glm::dvec2 colours_m);
  QSize sizeHint() const override { return {300, 180}; }
  QSize minimumSizeHint() const override { return {160, 120}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::optional<DeviationHistogram> histogram_;
  glm::dvec2 colours_m_{-1, 1};
};

HistogramPlot::HistogramPlot(QWidget* parent) : QWidget(parent) { setObjectName("histogram"); }

void HistogramPlot::show_histogram(std::optional<DeviationHistogram> histogram,
                                   glm::dvec2 colours_m) {
  histogram_ = std::move(histogram);
  colours_m_ = colours_m;
  if (histogram_) {
    setToolTip(text_of("{} below {:.4g} m, {} above {:.4g} m", histogram_->below, histogram_->low_m,
                       histogram_->above, histogram_->high_m));
  }
  update();
}

void HistogramPlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().base());
  if (!histogram_ || histogram_->counts.empty()) return;
  const QFontMetrics metrics = painter.fontMetrics();
  const QRectF plot(plot_margin_px, plot_margin_px, width() - 2 * plot_margin_px,
                    height() - 2 * plot_margin_px - metrics.height() - 4);
  const std::vector<std::size_t>& counts = histogram_->counts;
  const double most = static_cast<double>(
      std::max<std::size_t>(1, *std::max_element(counts.begin(), counts.end())));
  const double bar_px = plot.width() / static_cast<double>(counts.size());
  const double span_m = histogram_->high_m - histogram_->low_m;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(counts.size());
    const double value_m = histogram_->low_m + share * span_m;
    const double tall_px = plot.height() * static_cast<double>(counts[i]) / most;
    const double in_range = (value_m - colours_m_.x) / (colours_m_.y - colours_m_.x);
    painter.fillRect(QRectF(plot.left() + static_cast<double>(i) * bar_px, plot.bottom() - tall_px,
                            std::max(1.0, bar_px - 0.5), tall_px),
                     colour_of(colour_on(ColourScale::Signed, in_range)));
  }
  painter.setPen(palette().text().color());
  painter.drawLine(plot.bottomLeft(), plot.bottomRight());
  for (int i = 0; i < axis_ticks; ++i) {
    const double share = static_cast<double>(i) / (axis_ticks - 1);
    const QString text =
        text_of("{:.3g}{}", histogram_->low_m + share * span_m, i + 1 == axis_ticks ? " m" : "");
    const double x = plot.left() + share * plot.width();
    const double text_px = metrics.horizontalAdvance(text);
    painter.drawLine(QPointF(x, plot.bottom()), QPointF(x, plot.bottom() + 3));
    painter.drawText(QPointF(std::clamp(x - text_px / 2, 0.0, std::max(0.0, width() - text_px - 2)),
                             plot.bottom() + 4 + metrics.ascent()),
                     text);
  }
}

ComparePanel::ComparePanel(Hooks hooks, QWidget* parent)
    : QWidget(parent), hooks_(std::move(hooks)) {
  build();
  connect(compare_, &QPushButton::clicked, this, [this] { compare_chosen(); });
  connect(cancel_, &QPushButton::clicked, this, [this] { cancel(); });
  connect(layer_, qOverload<int>(&QComboBox::currentIndexChanged), this,
          [this] { offer_truths(); });
  connect(layer_, qOverload<int>(&QComboBox::activated), this, [this] { is_layer_chosen_ = true; });
  connect(truth_, qOverload<int>(&QComboBox::activated), this, [this] { is_truth_chosen_ = true; });
  update_buttons();
}

void ComparePanel::build() {
  layer_ = named(new QComboBox, "measured");
  truth_ = named(new QComboBox, "truth");
  for (QComboBox* box : {layer_, truth_}) {
    box->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    box->setMinimumContentsLength(16);
  }
  tolerance_ = named(new QDoubleSpinBox, "tolerance",
                     "Distance for the precision and completeness of two surfaces");
  tolerance_->setRange(0, 1e6);
  tolerance_->setDecimals(4);
  tolerance_->setSuffix(" m");
  tolerance_->setSpecialValueText("none");
  compare_ = named(new QPushButton("Compare"), "compare");
  cancel_ = new QPushButton("Cancel");
  progress_ = progress_bar();
  title_ = wrapped_label();
  plot_ = new HistogramPlot;
  figures_ = new FactTable;
  auto* form = new QFormLayout;
  form->addRow("Measured", layer_);
  form->addRow("Truth", truth_);
  form->addRow("Tolerance", tolerance_);
  auto* buttons = new QHBoxLayout;
  add_widgets(*buttons, {compare_, cancel_});
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(form);
  layout->addLayout(buttons);
  add_widgets(*layout, {progress_, title_});
  layout->addWidget(plot_, 1);
  layout->addWidget(figures_, 1);
}

void ComparePanel::offer(const std::vector<std::string>& layers, std::vector<Truth> truths) {
  truths_ = std::move(truths);
  std::vector<std::pair<std::string, int>> names;
  for (const std::string& layer : layers) names.emplace_back(layer, static_cast<int>(names.size()));
  fill(*layer_, names, is_layer_chosen_);
  offer_truths();
}

// Offers the truths that the selected layer does not show itself.
void ComparePanel::offer_truths() {
  const std::string layer = layer_->currentText().toStdString();
  std::vector<std::pair<std::string, int>> names;
  for (std::size_t i = 0; i < truths_.size(); ++i) {
    if (truths_[i].layer.empty() || truths_[i].layer != layer)
      names.emplace_back(truths_[i].name, static_cast<int>(i));
  }
  fill(*truth_, names, is_truth_chosen_);
  update_buttons();
}

void ComparePanel::choose(const std::string& layer, const std::string& truth) {
  for (const auto& [box, name] : {std::pair(layer_, layer), {truth_, truth}}) {
    const int index = box->findText(QString::fromStdString(name));
    if (index < 0) continue;
    box->setCurrentIndex(index);
    (box == layer_ ? is_layer_chosen_ : is_truth_chosen_) = true;
  }
}

void ComparePanel::update_buttons() {
  compare_->setEnabled(layer_->count() > 0 && truth_->count() > 0 && !is_comparing());
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
  if (layer == nullptr || truth_->currentIndex() < 0 || is_comparing()) return;
  Truth truth;
  try {
    truth = chosen_truth(static_cast<std::size_t>(truth_->currentData().toInt()));
  } catch (const Error& error) {
    if (hooks_.failed) hooks_.failed(error.what());
    return;
  }
  const auto work = [measured = *layer, truth, tolerance_m = tolerance_->value()](
                        const std::stop_token& stop, const JobProgress& report) {
    return compare(measured, truth, tolerance_m, stop, [&](double share) { report(share, ""); });
  };
  progress_->setValue(0);
  title_->clear();
  job_.start(work,
             [this, measured = *layer](const Comparison& comparison) {
               show_comparison(comparison);
               if (hooks_.compared) hooks_.compared(comparison, measured);
             },
             {.progress =
                  [this](double share, const std::string&) {
                    progress_->setValue(static_cast<int>(share * progress_steps));
                  },
              .failed = hooks_.failed,
              .cancelled = [this] { title_->setText("cancelled"); },
              .ended = [this] { update_buttons(); }});
  update_buttons();
}

void ComparePanel::show_comparison(const Comparison& comparison) {
  title_->setText(text_of("{}  against  {}", comparison.layer, comparison.truth));
  const double end_m = comparison.deviation.figures.p95_m;
  const double colours_m = end_m > 0 ? end_m : 1;
  plot_->show_histogram(comparison.histogram, {-colours_m, colours_m});
  figures_->show_facts(facts_of(comparison));
}

}  // namespace groundray
