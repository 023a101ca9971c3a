#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace groundray::golden {

/// Check that each row's value equals that of another formula, within a tolerance.
struct RowsCheck {
  std::string value, is, within;  ///< formulas
  double share = 1;               ///< fraction of the rows that must pass
};

/// Check that a statistic of all rows equals a number, within a tolerance.
struct FigureCheck {
  enum class Kind { Count, Mean, Deviation, Smallest, Largest };
  Kind kind = Kind::Mean;
  std::string value, is, within;  ///< formulas; `is` and `within` may use only `rows`
};

/// Check that all columns equal those of a stored file.
struct ExactCheck {};

/// Check that columns are samples of distributions with a stored mean and variance.
struct StatisticalCheck {
  std::vector<std::string> columns;
  double share = 1;  ///< fraction of the values that must pass
};

struct Check {
  std::variant<RowsCheck, FigureCheck, ExactCheck, StatisticalCheck> what;
  std::string because;  ///< origin of the tolerance
  int line = 0;         ///< line in the case's file
};

/// Expectations for one file of a dataset.
struct ProductChecks {
  std::string product;                                     ///< path relative to the dataset
  std::vector<std::pair<std::string, std::string>> names;  ///< formulas; each may use earlier ones
  std::string rows;                                        ///< condition; empty for all rows
  std::vector<Check> checks;
};

/// Scene with the expectations for its dataset: a folder with `scene.yaml`, `case.yaml`, and stored
/// files in `expected`.
struct GoldenCase {
  std::string name;  ///< name of the folder
  std::filesystem::path folder;
  std::string title;
  std::vector<ProductChecks> products;

  std::filesystem::path scene() const { return folder / "scene.yaml"; }
  std::filesystem::path expected() const { return folder / "expected"; }
};

/// Reads the case in a folder.
/// @throws Error that lists all faults, each with file and line.
GoldenCase read_case(const std::filesystem::path& folder);

/// Reads all cases in a folder whose names contain one of `filters` (all cases if `filters` is
/// empty), sorted by name.
/// @throws Error as read_case; if the folder does not exist, or there is no case, or none for one
///         of the filters.
std::vector<GoldenCase> read_cases(const std::filesystem::path& folder,
                                   const std::vector<std::string>& filters);

}  // namespace groundray::golden
