#pragma once

#include <QWidget>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/view/window/comparison.h"
#include "apps/view/window/fact_table.h"
#include "apps/view/window/job.h"

class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace groundray {

class HistogramPlot;

/// Measures what is shown against the truth: signed distances as colours, how they are spread, and
/// the numbers.
class ComparePanel : public QWidget {
 public:
  struct Hooks {
    std::function<const Layer*(const std::string&)> layer{};  ///< of a name, null if it is gone
    /// Of the layer as it was when the comparison began.
    std::function<void(const Comparison&, const Layer& measured)> compared{};
    std::function<void(const std::string&)> failed{};
  };

  explicit ComparePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Offers what there is; what was chosen stays chosen. Of a truth that is shown the layer's name
  /// is enough: it is taken as it is when it is compared with.
  void offer(const std::vector<std::string>& layers, std::vector<Truth> truths);
  /// Chooses by name; nothing happens to what has none such.
  void choose(const std::string& layer, const std::string& truth);
  void compare_chosen();
  void cancel() { job_.cancel(); }
  bool is_comparing() const noexcept { return job_.is_running(); }
  const FactTable& figures() const noexcept { return *figures_; }

 private:
  void build();
  void update_buttons();
  Truth chosen_truth(std::size_t index) const;
  void show_comparison(const Comparison& comparison);

  Hooks hooks_;
  std::vector<Truth> truths_;
  QComboBox *layer_ = nullptr, *truth_ = nullptr;
  QDoubleSpinBox* tolerance_ = nullptr;
  QPushButton *compare_ = nullptr, *cancel_ = nullptr;
  QProgressBar* progress_ = nullptr;
  HistogramPlot* plot_ = nullptr;
  FactTable* figures_ = nullptr;
  QLabel* title_ = nullptr;
  Job job_;
};

}  // namespace groundray
