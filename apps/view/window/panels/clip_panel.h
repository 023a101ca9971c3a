#pragma once

#include <QWidget>
#include <array>
#include <functional>
#include <optional>

#include "apps/view/rendering/clip_box.h"

class QCheckBox;
class QDoubleSpinBox;
class QPushButton;

namespace groundray {

/// Panel for the clipping box: its limits along the axes of W.
class ClipPanel : public QWidget {
 public:
  struct Hooks {
    std::function<std::optional<ClipBox>()> bounds{};              ///< of everything that is shown
    std::function<void(const std::optional<ClipBox>&)> changed{};  ///< std::nullopt if switched off
  };

  explicit ClipPanel(Hooks hooks, QWidget* parent = nullptr);

  /// Sets the box and switches clipping on.
  void set_box(const ClipBox& box);
  /// Extends the box to everything that is shown.
  void reset();
  bool is_on() const;

 private:
  void build();
  void fill(const ClipBox& box);
  void report();

  Hooks hooks_;
  bool is_filling_ = false, has_box_ = false;
  QCheckBox* on_ = nullptr;
  QPushButton* reset_ = nullptr;
  std::array<QDoubleSpinBox*, 3> low_{}, high_{};
};

}  // namespace groundray
