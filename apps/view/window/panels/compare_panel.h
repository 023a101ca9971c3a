#pragma once

#include <QWidget>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/view/compare/deviation.h"
#include "apps/view/window/job.h"
#include "apps/view/window/panels/fact_table.h"

class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace groundray {

class HistogramPlot;

/// Panel that compares a layer with the truth: signed distances as colours, as a histogram and as
/// statistics.
class ComparePanel : public QWidget {
 public:
  struct Hooks {
    std::function<const Layer*(const std::string&)> layer{};  ///< layer of a name, or null
    /// Called with the layer as it was when the comparison began.
    std::function<void(const Comparison&, const Layer& measured)> compared{};
    std::function<void(const std::string&)> failed{};
  };

  explicit ComparePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Offers layers and truths for selection, best first. Keeps what the user or choose() selected;
  /// otherwise selects the first of each. A layer is not offered its own surface as the truth. A
  /// truth that is a displayed surface needs only the layer's name: its data are taken when the
  /// comparison starts.
  void offer(const std::vector<std::string>& layers, std::vector<Truth> truths);
  /// Selects by name; unknown names have no effect.
  void choose(const std::string& layer, const std::string& truth);
  void compare_chosen();
  void cancel() { job_.cancel(); }
  bool is_comparing() const noexcept { return job_.is_running(); }
  const FactTable& figures() const noexcept { return *figures_; }

 private:
  void build();
  void offer_truths();
  void update_buttons();
  Truth chosen_truth(std::size_t index) const;
  void show_comparison(const Comparison& comparison);

  Hooks hooks_;
  std::vector<Truth> truths_;
  bool is_layer_chosen_ = false, is_truth_chosen_ = false;
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
