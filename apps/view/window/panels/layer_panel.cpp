#include "apps/view/window/panels/layer_panel.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QSlider>
#include <QTreeWidget>
#include <QVBoxLayout>
#include <array>
#include <cmath>
#include <exception>

#include "apps/view/window/widgets.h"

namespace groundray {
namespace {

constexpr int name_role = Qt::UserRole;
const QString one_colour = QStringLiteral("one colour");

// Texts by LayerKind.
constexpr std::array kind_texts{"terrain", "mesh", "points", "sensor", "trail", "picture"};

QString facts_text(const Layer& layer) {
  QStringList facts;
  for (const std::string& fact : layer.facts) facts << QString::fromStdString(fact);
  return facts.join('\n');
}

// Box for numbers of any magnitude, displayed with their significant digits.
class EndBox : public QDoubleSpinBox {
 public:
  EndBox() { setButtonSymbols(NoButtons); }  // the room is needed for digits
  QString textFromValue(double value) const override { return QString::number(value, 'g', digits); }
  double valueFromText(const QString& text) const override { return text.toDouble(); }
  QValidator::State validate(QString& text, int&) const override {
    bool is_number = false;
    text.toDouble(&is_number);
    return is_number ? QValidator::Acceptable : QValidator::Intermediate;
  }

 private:
  static constexpr int digits = 9;
};

// Tree that keeps the selected item visible when it is resized.
class LayerTree : public QTreeWidget {
 protected:
  void resizeEvent(QResizeEvent* event) override {
    QTreeWidget::resizeEvent(event);
    scrollToItem(currentItem());
  }
};

QDoubleSpinBox* set_up_number_box(QDoubleSpinBox* box, double least, double most, int decimals) {
  box->setDecimals(decimals);  // first, because it rounds the limits
  box->setRange(least, most);
  box->setKeyboardTracking(false);
  box->setMinimumWidth(70);  // the widest number would take half of the window
  box->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  return box;
}

}  // namespace

LayerPanel::LayerPanel(View& view, Hooks hooks, QWidget* parent)
    : QWidget(parent), view_(view), hooks_(std::move(hooks)) {
  build_tree();
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->addWidget(tree_, 1);
  looks_ = build_looks();
  layout->addWidget(looks_);
  show_looks();
}

void LayerPanel::build_tree() {
  tree_ = named(new LayerTree, "layers");
  tree_->setColumnCount(2);
  tree_->setHeaderLabels({"layer", "kind"});
  tree_->header()->setStretchLastSection(false);
  tree_->header()->setSectionResizeMode(0, QHeaderView::Stretch);
  tree_->header()->setSectionResizeMode(1, QHeaderView::ResizeToContents);
  tree_->setAlternatingRowColors(true);
  tree_->setUniformRowHeights(true);
  tree_->setMinimumHeight(60);
  connect(tree_, &QTreeWidget::itemChanged, this,
          [this](QTreeWidgetItem* item, int) { checked(item); });
  connect(tree_, &QTreeWidget::currentItemChanged, this, [this] {
    if (is_filling_) return;
    show_looks();
    if (hooks_.selected) hooks_.selected(selected());
  });
}

QWidget* LayerPanel::build_looks() {
  auto* looks = new QWidget;
  auto* form = new QFormLayout(looks);
  form->setContentsMargins(2, 4, 2, 2);
  column_ = named(new QComboBox, "colour_by");
  form->addRow("Colour by", column_);
  constexpr double any = 1e38;
  constexpr int any_decimals = 60;
  low_ = set_up_number_box(named(new EndBox, "range_low"), -any, any, any_decimals);
  high_ = set_up_number_box(named(new EndBox, "range_high"), -any, any, any_decimals);
  range_ = new QWidget;
  auto* ends = new QHBoxLayout(range_);
  ends->setContentsMargins(0, 0, 0, 0);
  ends->addWidget(low_, 1);
  ends->addWidget(new QLabel("to"));
  ends->addWidget(high_, 1);
  form->addRow("Range", range_);
  opacity_ = named(new QSlider(Qt::Horizontal), "opacity");
  opacity_->setRange(0, 100);
  form->addRow("Opacity", opacity_);
  point_size_ = set_up_number_box(new QDoubleSpinBox, 1, 32, 1);
  point_size_->setSuffix(" px");
  form->addRow("Point size", point_size_);
  wireframe_ = named(new QCheckBox("Wireframe"), "wireframe");
  form->addRow("", wireframe_);
  clipped_ = named(new QCheckBox("Clipped by the box"), "clipped");
  form->addRow("", clipped_);
  facts_ = wrapped_label();
  facts_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  form->addRow(facts_);
  connect_looks();
  return looks;
}

void LayerPanel::connect_looks() {
  connect(column_, qOverload<int>(&QComboBox::currentIndexChanged), this, [this](int index) {
    const std::string name = column_->itemData(index).toString().toStdString();
    change([&] { view_.colour_by(selected(), name); });
    if (const Layer* layer = view_.find(selected())) show_range(*layer);
  });
  connect(opacity_, &QSlider::valueChanged, this,
          [this](int share) { change([&] { view_.set_opacity(selected(), share / 100.0); }); });
  connect(wireframe_, &QCheckBox::toggled, this,
          [this](bool on) { change([&] { view_.set_wireframe(selected(), on); }); });
  connect(clipped_, &QCheckBox::toggled, this,
          [this](bool on) { change([&] { view_.set_clipped(selected(), on); }); });
  connect(point_size_, qOverload<double>(&QDoubleSpinBox::valueChanged), this,
          [this](double size) { change([&] { view_.set_point_size(selected(), size); }); });
  for (QDoubleSpinBox* box : {low_, high_}) {
    connect(box, qOverload<double>(&QDoubleSpinBox::valueChanged), this,
            [this, is_low = box == low_] { set_range(is_low); });
  }
}

void LayerPanel::change(const std::function<void()>& what) {
  if (is_filling_ || view_.find(selected()) == nullptr) return;
  try {
    what();
  } catch (const std::exception& error) {
    if (hooks_.failed) hooks_.failed(error.what());
  }
  if (hooks_.changed) hooks_.changed();
}

// Sets one end of the range; the other keeps its full precision.
void LayerPanel::set_range(bool is_low) {
  const Layer* layer = view_.find(selected());
  const LayerColumn* column = layer == nullptr ? nullptr : layer->find(layer->coloured_by);
  if (column == nullptr) return;
  glm::dvec2 range = column->range;
  (is_low ? range.x : range.y) = (is_low ? low_ : high_)->value();
  if (!(range.x < range.y)) return;
  const std::string name = column->name;
  change([&] { view_.set_range(selected(), name, range); });
}

QTreeWidgetItem* LayerPanel::branch(const QStringList& path) {
  QTreeWidgetItem* item = tree_->invisibleRootItem();
  for (const QString& part : path) {
    QTreeWidgetItem* found = nullptr;
    for (int i = 0; i < item->childCount() && found == nullptr; ++i) {
      const bool is_leaf = item->child(i)->data(0, name_role).isValid();
      if (!is_leaf && item->child(i)->text(0) == part) found = item->child(i);
    }
    if (found == nullptr) {
      found = new QTreeWidgetItem(item, {part});
      found->setFlags(found->flags() | Qt::ItemIsUserCheckable | Qt::ItemIsAutoTristate);
      found->setExpanded(true);
    }
    item = found;
  }
  return item;
}

void LayerPanel::add_leaf(const Layer& layer) {
  QStringList path = QString::fromStdString(layer.name).split('/');
  const QString last = path.takeLast();
  auto* item = new QTreeWidgetItem(branch(path),
                                   {last, kind_texts.at(static_cast<std::size_t>(layer.kind))});
  item->setData(0, name_role, QString::fromStdString(layer.name));
  item->setFlags(item->flags() | Qt::ItemIsUserCheckable);
  item->setCheckState(0, layer.visible ? Qt::Checked : Qt::Unchecked);
  item->setToolTip(0, facts_text(layer));
}

void LayerPanel::refresh() {
  const std::string before = selected();
  is_filling_ = true;
  tree_->clear();
  names_.clear();
  for (const Layer* layer : view_.layers()) {
    names_.push_back(layer->name);
    add_leaf(*layer);
  }
  is_filling_ = false;
  select(before);
}

std::string LayerPanel::selected() const {
  const QTreeWidgetItem* item = tree_->currentItem();
  return item == nullptr ? "" : item->data(0, name_role).toString().toStdString();
}

void LayerPanel::select(const std::string& layer) {
  is_filling_ = true;
  const auto found = tree_->findItems("*", Qt::MatchWildcard | Qt::MatchRecursive);
  for (QTreeWidgetItem* item : found) {
    if (item->data(0, name_role).toString() != QString::fromStdString(layer) || layer.empty())
      continue;
    tree_->setCurrentItem(item);
  }
  is_filling_ = false;
  show_looks();
  tree_->scrollToItem(tree_->currentItem());
}

// Called for each leaf below a branch, too: Qt passes the state of a branch on to its leaves.
void LayerPanel::checked(QTreeWidgetItem* item) {
  if (is_filling_) return;
  const std::string name = item->data(0, name_role).toString().toStdString();
  if (view_.find(name) != nullptr) view_.set_visible(name, item->checkState(0) == Qt::Checked);
  if (hooks_.changed) hooks_.changed();
}

void LayerPanel::show_looks() {
  const Layer* layer = view_.find(selected());
  looks_->setVisible(layer != nullptr);
  if (layer == nullptr) return;
  is_filling_ = true;
  show_columns(*layer);
  show_range(*layer);
  opacity_->setValue(static_cast<int>(std::lround(layer->opacity * 100)));
  wireframe_->setChecked(layer->wireframe);
  wireframe_->setVisible(layer->kind == LayerKind::Terrain || layer->kind == LayerKind::Mesh);
  clipped_->setChecked(layer->is_clipped);
  clipped_->setVisible(view_.clip().has_value());
  point_size_->setValue(layer->point_size_px);
  point_size_->setEnabled(layer->kind == LayerKind::Cloud);
  facts_->setText(facts_text(*layer));
  is_filling_ = false;
}

void LayerPanel::show_columns(const Layer& layer) {
  column_->clear();
  column_->addItem(one_colour, QString());
  for (const LayerColumn& column : layer.columns) {
    const QString unit =
        column.unit.empty() ? QString() : QString::fromStdString(" [" + column.unit + "]");
    column_->addItem(QString::fromStdString(column.name) + unit,
                     QString::fromStdString(column.name));
    if (column.name == layer.coloured_by) column_->setCurrentIndex(column_->count() - 1);
  }
}

void LayerPanel::show_range(const Layer& layer) {
  const LayerColumn* column = layer.find(layer.coloured_by);
  range_->setEnabled(column != nullptr && !column->is_rgb && column->categories.empty());
  if (column == nullptr) return;
  const bool was_filling = is_filling_;
  is_filling_ = true;
  const double step = (column->range.y - column->range.x) / 50;
  for (QDoubleSpinBox* box : {low_, high_}) box->setSingleStep(step > 0 ? step : 1);
  low_->setValue(column->range.x);
  high_->setValue(column->range.y);
  is_filling_ = was_filling;
}

}  // namespace groundray
