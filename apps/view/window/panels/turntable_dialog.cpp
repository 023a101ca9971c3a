#include "apps/view/window/panels/turntable_dialog.h"

#include <fmt/format.h>

#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QSpinBox>
#include <QVBoxLayout>
#include <numbers>
#include <system_error>

#include "apps/view/window/orbit.h"
#include "core/error.h"

namespace groundray {
namespace {

constexpr int most_pictures = 9999;  // file names have four digits
constexpr int pictures_at_first = 36;
constexpr int largest_px = 16384;

QSpinBox* whole_number_box(const char* name, int least, int most, int value) {
  auto* box = new QSpinBox;
  box->setObjectName(name);
  box->setRange(least, most);
  box->setValue(value);
  return box;
}

}  // namespace

TurntableDialog::TurntableDialog(const Look& begin, glm::ivec2 size_px, Hooks hooks,
                                 QWidget* parent)
    : QDialog(parent), begin_(begin), hooks_(std::move(hooks)) {
  setObjectName("turntable");
  setWindowTitle("Turntable");
  setAttribute(Qt::WA_DeleteOnClose);
  build(size_px);
  next_.setInterval(0);
  connect(&next_, &QTimer::timeout, this, [this] { write_next(); });
}

void TurntableDialog::build(glm::ivec2 size_px) {
  pictures_ = whole_number_box("turntable_pictures", 2, most_pictures, pictures_at_first);
  pictures_->setToolTip("Number for a complete turn: 36 for one every ten degrees");
  width_ = whole_number_box("turntable_width", 16, largest_px, size_px.x);
  height_ = whole_number_box("turntable_height", 16, largest_px, size_px.y);
  for (QSpinBox* box : {width_, height_}) box->setSuffix(" px");
  asked_ = new QWidget;
  auto* form = new QFormLayout(asked_);
  form->setContentsMargins(0, 0, 0, 0);
  form->addRow("Pictures", pictures_);
  form->addRow("Width", width_);
  form->addRow("Height", height_);
  form->addRow("Folder", build_folder());
  progress_ = new QProgressBar;
  progress_->hide();
  status_ = new QLabel("A turn about the focal point, as 0000.png, 0001.png ...");
  status_->setObjectName("turntable_status");
  status_->setWordWrap(true);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
  write_ = buttons->addButton("Write", QDialogButtonBox::ActionRole);
  write_->setObjectName("turntable_write");
  write_->setDefault(true);
  connect(write_, &QPushButton::clicked, this, [this] { begin(); });
  connect(buttons, &QDialogButtonBox::rejected, this, [this] { reject(); });
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(asked_);
  layout->addWidget(progress_);
  layout->addWidget(status_);
  layout->addWidget(buttons);
  setMinimumWidth(440);
}

QWidget* TurntableDialog::build_folder() {
  folder_ = new QLineEdit("turntable");
  folder_->setObjectName("turntable_folder");
  folder_->setToolTip("It is created if it does not exist");
  auto* choose = new QPushButton("Choose...");
  choose->setAutoDefault(false);
  connect(choose, &QPushButton::clicked, this, [this] {
    const QString chosen = QFileDialog::getExistingDirectory(this, "Folder of the pictures");
    if (!chosen.isEmpty()) folder_->setText(chosen);
  });
  auto* row = new QWidget;
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(folder_, 1);
  layout->addWidget(choose);
  return row;
}

void TurntableDialog::begin() {
  const std::filesystem::path folder = folder_->text().trimmed().toStdString();
  if (folder.empty()) return stop("Name a folder for the pictures.");
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (fault) {
    stop("");
    if (hooks_.failed) {
      hooks_.failed(
          fmt::format("{}: the folder cannot be created: {}", folder.string(), fault.message()));
    }
    return;
  }
  written_ = 0;
  progress_->setRange(0, pictures_->value());
  progress_->setValue(0);
  progress_->show();
  asked_->setEnabled(false);
  write_->setEnabled(false);
  status_->setText("writing; Close stops it");
  next_.start();
}

void TurntableDialog::write_next() {
  const int pictures = pictures_->value();
  const std::filesystem::path folder = folder_->text().trimmed().toStdString();
  const Look look = orbited(begin_, 2 * std::numbers::pi * written_ / pictures, 0);
  try {
    hooks_.write(look, folder / fmt::format("{:04}.png", written_),
                 {width_->value(), height_->value()});
  } catch (const std::exception& fault) {
    stop("failed");
    if (hooks_.failed) hooks_.failed(fault.what());
    return;
  }
  progress_->setValue(++written_);
  if (written_ < pictures) return;
  stop(QString::fromStdString(fmt::format("{} pictures are in {}", pictures, folder.string())));
}

void TurntableDialog::stop(const QString& why) {
  next_.stop();
  progress_->hide();
  asked_->setEnabled(true);
  write_->setEnabled(true);
  status_->setText(why);
}

void TurntableDialog::reject() {
  if (!is_writing()) return QDialog::reject();
  stop(QString::fromStdString(fmt::format("stopped after {} pictures", written_)));
}

}  // namespace groundray
