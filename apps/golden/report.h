#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/colour_map.h"
#include "core/image/image.h"

namespace groundray::golden {

enum class Verdict {
  Passed,
  Failed,
  Told,  ///< figure without a limit
};

/// Returns the name of a verdict in reports: "passed", "failed" or "told".
const char* word_of(Verdict verdict);

/// Figure with its limit, if it has one.
struct Measure {
  std::string name;
  double value = 0;
  std::string unit;                 ///< "m", "px", "rows"; empty for a plain number
  std::optional<double> limit;      ///< largest permitted value
  std::string because;              ///< origin of the limit
  Verdict verdict = Verdict::Told;  ///< without a limit: Told, or Failed whatever the value
};

/// Counts of values in equal steps from `low` to `high`; values outside are counted separately.
struct Histogram {
  std::string title;  ///< the quantity whose values are counted
  std::string unit;
  double low = 0;
  double high = 1;
  std::vector<std::uint64_t> counts;
  std::uint64_t below = 0;
  std::uint64_t above = 0;
  std::string counted = "count";  ///< label of the axis of counts: what one count is
};

/// Table of figures by class; each row has as many cells as there are columns.
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

/// Axis of a picture; `low` may exceed `high`.
struct Axis {
  std::string label;         ///< quantity and unit, such as "east, m"
  double low = 0, high = 1;  ///< values at its two ends
};

/// Legend of a picture's colours.
struct ColourBar {
  std::string label;            ///< quantity and unit
  std::vector<Colour> colours;  ///< at equal distances, from the lower to the upper end
  /// Texts at fractions of the bar's length, 0 at the lower end.
  std::vector<std::pair<double, std::string>> marks;
};

/// Content of a picture.
enum class Shown {
  Data,   ///< one or both of the compared data
  Errors  ///< places of the differences between them
};

/// Picture of 1 or 3 channels for visual inspection.
struct Picture {
  std::string caption;
  Image8 image;
  Shown shown = Shown::Data;
  std::optional<Axis> across{};  ///< from the left edge to the right one
  std::optional<Axis> up{};      ///< from the lower edge to the upper one
  std::optional<ColourBar> bar{};
};

/// Results of one case or comparison.
struct Section {
  std::string title;
  Verdict verdict = Verdict::Told;
  std::string headline;           ///< one sentence: what differs, and by how much; may be empty
  std::vector<std::string> main;  ///< names of the measures that are shown first, in that order
  std::string text;               ///< paragraph; may be empty
  std::vector<Measure> measures;
  std::vector<Table> tables;
  std::vector<Histogram> histograms;
  std::vector<Picture> pictures;
};

struct Report {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, such as version
  std::vector<Section> sections;
};

/// Returns Failed if any measure failed, else Passed if any passed, else Told.
Verdict verdict_of(const std::vector<Measure>& measures);

/// Returns the verdict and the headline: "Failed: RMS is 2 m, but may be at most 1 m. The other's
/// ..."; without limits, that there is no verdict follows the headline.
std::string first_words(const Section& section);

/// Returns the measures that `section.main` names, in its order; names without a measure are
/// skipped.
std::vector<Measure> main_measures(const Section& section);

/// Adds a figure without a limit.
void tell(Section& into, std::string name, double value, std::string unit = {});

/// Adds a figure that passes if it is at most `limit`.
void hold(Section& into, std::string name, double value, std::string unit, double limit,
          std::string because);

/// Adds a figure that fails without a limit, because nothing can be checked.
void fail(Section& into, std::string name, double value, std::string unit, std::string because);

/// Counts the finite `values` in `bins` equal steps from `low` to `high`. Without valid steps, e.g.
/// for infinite limits, all values count as below or above.
Histogram histogram_of(std::string title, std::string unit, const std::vector<double>& values,
                       double low, double high, std::size_t bins = 60);

/// Checks, before long work, that reports may be written into a folder.
/// @throws Error if it is a dataset, whose files are its own.
void check_report_folder(const std::filesystem::path& folder);

/// Writes a self-contained HTML file with all pictures and charts, without scripts. A section with
/// main figures begins with its headline, these figures and pictures of the errors; further
/// figures, tables and pictures of the data are collapsed.
/// @throws Error as write_whole.
void write_html(const std::filesystem::path& path, const Report& report);

/// Writes facts, headlines, texts, measures, tables and histograms as JSON; non-finite numbers
/// become null.
/// @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const Report& report);

}  // namespace groundray::golden
