#include "apps/view/window/panels/origin_dialog.h"

#include <QComboBox>
#include <QDialog>
#include <QDialogButtonBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <array>
#include <utility>

#include "apps/view/window/widgets.h"

namespace groundray {

void ask_for_origin(QWidget* parent, const std::string& layer, const glm::dvec3& at_first,
                    const KnownOrigins& known, std::function<void(const glm::dvec3&)> done) {
  auto* dialog = new QDialog(parent);
  dialog->setObjectName("origin");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(text_of("Origin of {}", layer));
  auto* form = new QFormLayout(dialog);
  form->addRow(
      wrapped_label("Map coordinates of the point at which the file's coordinates are 0."));
  auto* offered = named(new QComboBox, "known_origins");
  offered->addItem("choose ...");
  for (const auto& each : known) offered->addItem(QString::fromStdString(each.first));
  if (!known.empty()) form->addRow("Same as", offered);
  std::array<QDoubleSpinBox*, 3> boxes{};
  constexpr std::array names{"east", "north", "up"};
  const auto fill = [](const std::array<QDoubleSpinBox*, 3>& into, const glm::dvec3& origin_w_m) {
    for (std::size_t k = 0; k < 3; ++k)
      into[k]->setValue(origin_w_m[static_cast<glm::length_t>(k)]);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    boxes[k] = named(new QDoubleSpinBox, names[k]);
    boxes[k]->setDecimals(4);
    boxes[k]->setRange(-1e12, 1e12);
    boxes[k]->setSuffix(" m");
    form->addRow(names[k], boxes[k]);
  }
  fill(boxes, at_first);
  QObject::connect(offered, qOverload<int>(&QComboBox::activated), dialog,
                   [fill, boxes, known](int index) {
                     if (index > 0) fill(boxes, known[static_cast<std::size_t>(index - 1)].second);
                   });
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Ok | QDialogButtonBox::Cancel);
  QObject::connect(buttons, &QDialogButtonBox::accepted, dialog,
                   [dialog, boxes, done = std::move(done)] {
                     done({boxes[0]->value(), boxes[1]->value(), boxes[2]->value()});
                     dialog->accept();
                   });
  QObject::connect(buttons, &QDialogButtonBox::rejected, dialog, &QDialog::reject);
  form->addRow(buttons);
  dialog->open();
}

}  // namespace groundray
