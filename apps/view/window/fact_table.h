#pragma once

#include <QTableWidget>
#include <string>
#include <utility>
#include <vector>

namespace groundray {

/// Names and values, a line each; they can be selected and copied.
class FactTable : public QTableWidget {
 public:
  using Facts = std::vector<std::pair<std::string, std::string>>;

  explicit FactTable(QWidget* parent = nullptr);

  void show_facts(const Facts& facts);
  /// Returns the value of a name, empty if there is none.
  std::string value(const std::string& name) const;

 protected:
  void keyPressEvent(QKeyEvent* event) override;  // Ctrl+C copies the lines that are selected
};

}  // namespace groundray
