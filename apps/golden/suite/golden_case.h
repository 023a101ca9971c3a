#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace groundray::golden {

/// Each row's value is that of another formula, to a tolerance.
struct RowsCheck {
  std::string value, is, within;  ///< formulas
  double share = 1;               ///< of the rows, at least
};

/// A figure of all rows is a number, to a tolerance.
struct FigureCheck {
  enum class Kind { Count, Mean, Deviation, Smallest, Largest };
  Kind kind = Kind::Mean;
  std::string value, is, within;  ///< formulas; those of `is` and `within` are of `rows` alone
};

/// All columns are those of a stored file: bit for bit with the C library that it was made with.
struct ExactCheck {};

/// Columns are draws of which mean and variance are stored.
struct StatisticalCheck {
  std::vector<std::string> columns;
  double share = 1;  ///< of the values, at least
};

struct Check {
  std::variant<RowsCheck, FigureCheck, ExactCheck, StatisticalCheck> what;
  std::string because;  ///< where the tolerance comes from
  int line = 0;         ///< of the case's file
};

/// What is expected of one file of a dataset.
struct ProductChecks {
  std::string product;                                     ///< path in the dataset
  std::vector<std::pair<std::string, std::string>> names;  ///< formulas, each may use those before
  std::string rows;                                        ///< a condition; empty for all rows
  std::vector<Check> checks;
};

/// A scene and what is expected of its dataset: a folder with `scene.yaml`, `case.yaml`, and what
/// is stored in `expected`.
struct GoldenCase {
  std::string name;  ///< of the folder
  std::filesystem::path folder;
  std::string title;
  std::vector<ProductChecks> products;

  std::filesystem::path scene() const { return folder / "scene.yaml"; }
  std::filesystem::path expected() const { return folder / "expected"; }
};

/// Reads the case in a folder. @throws Error listing all that is wrong, each with file and line.
GoldenCase read_case(const std::filesystem::path& folder);

/// Reads all cases of a folder whose names contain one of `filters` (all, if there is none), by
/// name. @throws Error likewise; if there is none, or none for one of the filters.
std::vector<GoldenCase> read_cases(const std::filesystem::path& folder,
                                   const std::vector<std::string>& filters);

}  // namespace groundray::golden
