#pragma once

#include <QDialog>
#include <QSize>
#include <QString>
#include <QTimer>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <string>

#include "apps/view/rendering/view.h"

class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;
class QSpinBox;

namespace groundray {

/// Returns the description of mouse and keyboard commands, as HTML.
QString help_text();

/// Shows the description in a dialog.
void show_help(QWidget* parent);

/// Asks for a picture's size, px; std::nullopt if the user cancels.
std::optional<glm::ivec2> ask_for_size(QWidget* parent, QSize at_first);

/// Dialog for a turntable: writes pictures of a full turn round the target as 0000.png, 0001.png
/// and so on, one after the other, while the window stays responsive.
class TurntableDialog : public QDialog {
 public:
  struct Hooks {
    /// Writes a picture from a viewpoint; an exception ends the turn.
    std::function<void(const Look&, const std::filesystem::path&, glm::ivec2 size_px)> write{};
    std::function<void(const std::string&)> failed{};  ///< error message
  };

  /// @param begin  first viewpoint.
  TurntableDialog(const Look& begin, glm::ivec2 size_px, Hooks hooks, QWidget* parent);

  bool is_writing() const { return next_.isActive(); }
  void reject() override;  // while writing, only stops that

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
  QWidget* asked_ = nullptr;  // all input widgets
  QProgressBar* progress_ = nullptr;
  QLabel* status_ = nullptr;
  QPushButton* write_ = nullptr;
};

}  // namespace groundray
