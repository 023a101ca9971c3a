#pragma once

#include <QDialog>
#include <QTimer>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <string>

#include "apps/view/view.h"

class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;
class QSpinBox;

namespace groundray {

/// Asks for a turntable, pictures of a whole turn round what is looked at, and writes them as
/// 0000.png, 0001.png ... one after the other, while the window goes on.
class TurntableDialog : public QDialog {
 public:
  struct Hooks {
    /// Writes a picture as it is seen from somewhere. What it throws ends the turn.
    std::function<void(const Look&, const std::filesystem::path&, glm::ivec2 size_px)> write{};
    std::function<void(const std::string&)> failed{};  ///< with the fault's message
  };

  /// @param begin  where the turn begins.
  TurntableDialog(const Look& begin, glm::ivec2 size_px, Hooks hooks, QWidget* parent);

  bool is_writing() const { return next_.isActive(); }
  void reject() override;  // stops what is being written first

 private:
  void build(glm::ivec2 size_px);
  QWidget* build_folder();
  void begin();
  void write_next();
  void stop(const QString& why);

  Look begin_;
  Hooks hooks_;
  QTimer next_;
  int written_ = 0;
  QSpinBox *pictures_ = nullptr, *width_ = nullptr, *height_ = nullptr;
  QLineEdit* folder_ = nullptr;
  QWidget* asked_ = nullptr;  // all that can be chosen
  QProgressBar* progress_ = nullptr;
  QLabel* status_ = nullptr;
  QPushButton* write_ = nullptr;
};

}  // namespace groundray
