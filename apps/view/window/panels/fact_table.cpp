#include "apps/view/window/panels/fact_table.h"

#include <QApplication>
#include <QClipboard>
#include <QHeaderView>
#include <QKeyEvent>

namespace groundray {

FactTable::FactTable(QWidget* parent) : QTableWidget(0, 2, parent) {
  setHorizontalHeaderLabels({"what", "value"});
  horizontalHeader()->setVisible(false);
  horizontalHeader()->setSectionResizeMode(0, QHeaderView::ResizeToContents);
  horizontalHeader()->setSectionResizeMode(1, QHeaderView::Stretch);
  verticalHeader()->setVisible(false);
  verticalHeader()->setDefaultSectionSize(fontMetrics().height() + 6);
  setEditTriggers(QAbstractItemView::NoEditTriggers);
  setSelectionBehavior(QAbstractItemView::SelectRows);
  setAlternatingRowColors(true);
  setShowGrid(false);
  setWordWrap(false);
  setMinimumHeight(3 * verticalHeader()->defaultSectionSize());
}

void FactTable::show_facts(const Facts& facts) {
  setRowCount(static_cast<int>(facts.size()));
  int row = 0;
  for (const auto& [name, value] : facts) {
    setItem(row, 0, new QTableWidgetItem(QString::fromStdString(name)));
    auto* cell = new QTableWidgetItem(QString::fromStdString(value));
    cell->setToolTip(cell->text());
    setItem(row++, 1, cell);
  }
}

std::string FactTable::value(const std::string& name) const {
  for (int row = 0; row < rowCount(); ++row) {
    if (item(row, 0)->text().toStdString() == name) return item(row, 1)->text().toStdString();
  }
  return "";
}

void FactTable::keyPressEvent(QKeyEvent* event) {
  if (!event->matches(QKeySequence::Copy)) return QTableWidget::keyPressEvent(event);
  QStringList lines;
  for (int row = 0; row < rowCount(); ++row) {
    if (item(row, 0)->isSelected()) lines << item(row, 0)->text() + '\t' + item(row, 1)->text();
  }
  QApplication::clipboard()->setText(lines.join('\n'));
}

}  // namespace groundray
