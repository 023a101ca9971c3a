#pragma once

#include <QWidget>
#include <functional>
#include <string>
#include <vector>

#include "apps/view/view.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QSlider;
class QTreeWidget;
class QTreeWidgetItem;

namespace groundray {

/// The tree of what a view shows: what of it is visible, and how it is drawn.
class LayerPanel : public QWidget {
 public:
  /// What is called as it is used; any may be empty.
  struct Hooks {
    std::function<void()> changed{};                     ///< something looks different now
    std::function<void(const std::string&)> selected{};  ///< a layer's name; empty for none
    std::function<void(const std::string&)> failed{};    ///< with the fault's message
  };

  /// @param view  is to outlive this.
  LayerPanel(View& view, Hooks hooks, QWidget* parent = nullptr);

  /// Shows what the view holds now; what was selected stays so.
  void refresh();
  /// Returns the names of the layers that it shows, in the view's order.
  const std::vector<std::string>& names() const noexcept { return names_; }
  /// Returns the selected layer's name, empty if there is none.
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
  bool is_filling_ = false;  // what changes is not the user's doing
  QTreeWidget* tree_ = nullptr;
  QWidget* looks_ = nullptr;
  QComboBox* column_ = nullptr;
  QDoubleSpinBox *low_ = nullptr, *high_ = nullptr;
  QWidget* range_ = nullptr;
  QSlider* opacity_ = nullptr;
  QCheckBox* wireframe_ = nullptr;
  QDoubleSpinBox* point_size_ = nullptr;
  QLabel* facts_ = nullptr;
};

}  // namespace groundray
