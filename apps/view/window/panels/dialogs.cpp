#include "apps/view/window/panels/dialogs.h"

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
#include <QTextBrowser>
#include <QVBoxLayout>
#include <numbers>
#include <system_error>

#include "apps/view/window/orbit.h"
#include "apps/view/window/widgets.h"
#include "core/error.h"

namespace groundray {
namespace {

constexpr const char* help_html = R"(
<style>td { padding: 1px 14px 1px 0; } h3 { margin: 10px 0 2px 0; }</style>
<h3>Opening</h3>
<p>Drop scenes (.yaml), datasets (their folders), meshes, clouds, DEMs and pictures into the window,
or use <b>Ctrl+O</b> and, for a dataset's folder, <b>Ctrl+Shift+O</b>. Recent files are in the
menu <i>File</i>.</p>
<h3>Mouse</h3>
<table>
<tr><td>drag left</td><td>turn about the focal point; up stays up</td></tr>
<tr><td>drag in the middle, Shift + left</td><td>move</td></tr>
<tr><td>wheel, drag right</td><td>zoom: the wheel zooms towards the pointer</td></tr>
<tr><td>double click</td><td>set the focal point</td></tr>
<tr><td>click</td><td>pick an echo, a point or a triangle: shows its values, beam and footprint</td></tr>
<tr><td>Ctrl + click</td><td>put the terrain's viewpoint there</td></tr>
</table>
<h3>Keys</h3>
<table>
<tr><td>F, Home</td><td>see all</td><td>Z</td><td>see the selected layer</td></tr>
<tr><td>W A S D, Q E</td><td>fly forwards, sideways, down and up</td><td>arrows</td><td>turn</td></tr>
<tr><td>1 2 3 4</td><td>from above, south, east, oblique</td><td>+ -</td><td>nearer, farther</td></tr>
<tr><td>T</td><td>surfaces as wireframe</td><td>L</td><td>legend</td></tr>
<tr><td>Space</td><td>play, pause</td><td>, .</td><td>previous frame, next frame</td></tr>
<tr><td>N</td><td>scan here</td><td>C</td><td>compare with the truth</td></tr>
<tr><td>M</td><td>measure distances</td><td>B</td><td>clip by a box</td></tr>
<tr><td>Y</td><td>eye-dome lighting</td><td>Ctrl+G</td><td>set the origin of a mesh or cloud</td></tr>
<tr><td>Ctrl+O</td><td>open files</td><td>Ctrl+Shift+O</td><td>open a dataset's folder</td></tr>
<tr><td>Ctrl+S</td><td>save a picture</td><td>Ctrl+T</td><td>save a turntable</td></tr>
<tr><td>Delete</td><td>close the selected layer</td><td>Ctrl+W</td><td>close all</td></tr>
<tr><td>Escape</td><td>cancel; clear picks</td><td>F11</td><td>full screen</td></tr>
<tr><td>F1</td><td>this page</td><td>Ctrl+Q</td><td>quit</td></tr>
</table>
<h3>Images</h3>
<p>Point at a pixel for its value; click for its ray and the surface that it hits. The wheel
zooms, a double click shows all. The slider changes the exposure of light and pictures, also of those
shown in the view; <i>Echoes</i> shows the current scans over a camera's image.</p>
<h3>Measure</h3>
<p>Click two points: those of clouds and, near a corner of a triangle, that corner are exact; elsewhere the
surface counts. A third click begins anew; Escape ends measuring.</p>
<h3>Scan here</h3>
<p>For a scene, or a DEM as bare ground: choose a sensor, press <i>Place it in the view</i>, press on the ground at
its position and drag in its direction; then <i>Scan</i>.</p>
<h3>Compare</h3>
<p>Choose the measured layer and the truth: a scene's ground, a DEM, or a displayed surface. Both must
be in the same frame. Deviations above the truth, or on the side that its triangles face, are positive.</p>
)";

constexpr int most_pictures = 9999;  // file names have four digits
constexpr int pictures_at_first = 36;
constexpr int largest_px = 16384, largest_picture_px = 32768;

QSpinBox* whole_number_box(const char* name, int least, int most, int value,
                           const char* suffix = "") {
  auto* box = named(new QSpinBox, name);
  box->setRange(least, most);
  box->setValue(value);
  box->setSuffix(suffix);
  return box;
}

}  // namespace

QString help_text() { return QString::fromUtf8(help_html); }

void show_help(QWidget* parent) {
  auto* dialog = new QDialog(parent);
  dialog->setObjectName("help");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle("Mouse and keys");
  auto* browser = new QTextBrowser;
  browser->setHtml(help_text());
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
  QObject::connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::close);
  auto* layout = new QVBoxLayout(dialog);
  add_widgets(*layout, {browser, buttons});
  dialog->resize(720, 640);
  dialog->show();
}

std::optional<glm::ivec2> ask_for_size(QWidget* parent, QSize at_first) {
  QDialog dialog(parent);
  dialog.setWindowTitle("Size of the picture");
  auto* width = whole_number_box("width", 16, largest_picture_px, at_first.width(), " px");
  auto* height = whole_number_box("height", 16, largest_picture_px, at_first.height(), " px");
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Ok | QDialogButtonBox::Cancel);
  QObject::connect(buttons, &QDialogButtonBox::accepted, &dialog, &QDialog::accept);
  QObject::connect(buttons, &QDialogButtonBox::rejected, &dialog, &QDialog::reject);
  auto* form = new QFormLayout(&dialog);
  form->addRow("Width", width);
  form->addRow("Height", height);
  form->addRow(buttons);
  if (dialog.exec() != QDialog::Accepted) return std::nullopt;
  return glm::ivec2(width->value(), height->value());
}

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
  width_ = whole_number_box("turntable_width", 16, largest_px, size_px.x, " px");
  height_ = whole_number_box("turntable_height", 16, largest_px, size_px.y, " px");
  asked_ = new QWidget;
  auto* form = new QFormLayout(asked_);
  form->setContentsMargins(0, 0, 0, 0);
  form->addRow("Pictures", pictures_);
  form->addRow("Width", width_);
  form->addRow("Height", height_);
  form->addRow("Folder", build_folder());
  progress_ = new QProgressBar;
  progress_->hide();
  status_ = named(wrapped_label("A turn about the focal point, as 0000.png, 0001.png ..."),
                  "turntable_status");
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close);
  write_ = buttons->addButton("Write", QDialogButtonBox::ActionRole);
  write_->setObjectName("turntable_write");
  write_->setDefault(true);
  connect(write_, &QPushButton::clicked, this, [this] { begin(); });
  connect(buttons, &QDialogButtonBox::rejected, this, [this] { reject(); });
  auto* layout = new QVBoxLayout(this);
  add_widgets(*layout, {asked_, progress_, status_, buttons});
  setMinimumWidth(440);
}

QWidget* TurntableDialog::build_folder() {
  folder_ =
      named(new QLineEdit("turntable"), "turntable_folder", "It is created if it does not exist");
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
  stop(text_of("{} pictures are in {}", pictures, folder.string()));
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
  stop(text_of("stopped after {} pictures", written_));
}

}  // namespace groundray
