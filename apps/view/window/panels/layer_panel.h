#pragma once

#include <QWidget>
#include <functional>
#include <string>
#include <vector>

#include "apps/view/rendering/view.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QSlider;
class QTreeWidget;
class QTreeWidgetItem;

namespace groundray {

/// Tree of a view's layers with their visibility, and settings of the selected layer.
class LayerPanel : public QWidget {
 public:
  /// Callbacks; any may be empty.
  struct Hooks {
    std::function<void()> changed{};                     ///< the appearance of the view has changed
    std::function<void(const std::string&)> selected{};  ///< name of the layer; empty for none
    std::function<void(const std::string&)> failed{};    ///< error message
  };

  /// @param view  must outlive this.
  LayerPanel(View& view, Hooks hooks, QWidget* parent = nullptr);

  /// Shows the view's present layers, and keeps the selection.
  void refresh();
  /// Returns the names of the listed layers, in the view's order.
  const std::vector<std::string>& names() const noexcept { return names_; }
  /// Returns the selected layer's name; empty if there is none.
  std::string selected() const;
  void select(const std::string& layer);

 private:
  void build_tree();
  QWidget* build_looks();
  void connect_looks();
  QTreeWidgetItem* branch(const QStringList& path);
  void add_leaf(const Layer& layer);
  void checked(QTreeWidgetItem* item);
  void show_looks();
  void show_columns(const Layer& layer);
  void show_range(const Layer& layer);
  void set_range(bool is_low);
  void change(const std::function<void()>& what);

  View& view_;
  Hooks hooks_;
  std::vector<std::string> names_;
  bool is_filling_ = false;  // true while widgets are changed by the program
  QTreeWidget* tree_ = nullptr;
  QWidget* looks_ = nullptr;
  QComboBox* column_ = nullptr;
  QDoubleSpinBox *low_ = nullptr, *high_ = nullptr;
  QWidget* range_ = nullptr;
  QSlider* opacity_ = nullptr;
  QCheckBox *wireframe_ = nullptr, *clipped_ = nullptr;
  QDoubleSpinBox* point_size_ = nullptr;
  QLabel* facts_ = nullptr;
};

}  // namespace groundray
