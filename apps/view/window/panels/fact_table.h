#pragma once

#include <QTableWidget>
#include <string>
#include <utility>
#include <vector>

namespace groundray {

/// Table of names and values, whose lines can be selected and copied.
class FactTable : public QTableWidget {
 public:
  using Facts = std::vector<std::pair<std::string, std::string>>;

  explicit FactTable(QWidget* parent = nullptr);

  void show_facts(const Facts& facts);
  /// Returns the value of a name; empty if there is none.
  std::string value(const std::string& name) const;

 protected:
  void keyPressEvent(QKeyEvent* event) override;  // Ctrl+C copies the selected lines
};

}  // namespace groundray
