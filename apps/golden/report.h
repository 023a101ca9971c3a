#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/image.h"

namespace groundray::golden {

enum class Verdict {
  Passed,
  Failed,
  Told,  ///< a figure that is held against nothing
};

/// Returns it as reports have it: "passed", "failed" or "told".
const char* word_of(Verdict verdict);

/// A figure, and what it was held against.
struct Measure {
  std::string name;
  double value = 0;
  std::string unit;                 ///< "m", "px", "rows"; empty for a plain number
  std::optional<double> limit;      ///< the value must not exceed it
  std::string because;              ///< where the limit comes from
  Verdict verdict = Verdict::Told;  ///< without a limit it is Told, or Failed whatever the value
};

/// How often values fell into equal steps from `low` to `high`; those outside are counted apart.
struct Histogram {
  std::string title;
  std::string unit;
  double low = 0;
  double high = 1;
  std::vector<std::uint64_t> counts;
  std::uint64_t below = 0;
  std::uint64_t above = 0;
};

/// Figures by class: a row for each, of as many cells as there are columns.
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

/// An aid to the reader's eye, of 1 or 3 channels.
struct Picture {
  std::string caption;
  Image8 image;
};

/// What was found about one thing.
struct Section {
  std::string title;
  Verdict verdict = Verdict::Told;
  std::string text;  ///< a paragraph; empty for none
  std::vector<Measure> measures;
  std::vector<Table> tables;
  std::vector<Histogram> histograms;
  std::vector<Picture> pictures;
};

struct Report {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value: version, files, time
  std::vector<Section> sections;
};

/// Failed if any measure failed, else Passed if any passed, else Told.
Verdict verdict_of(const std::vector<Measure>& measures);

/// Tells a figure that is held against nothing.
void tell(Section& into, std::string name, double value, std::string unit = {});

/// Holds a figure against a limit.
void hold(Section& into, std::string name, double value, std::string unit, double limit,
          std::string because);

/// Tells a figure that fails though there is no limit to it: there is nothing to hold.
void fail(Section& into, std::string name, double value, std::string unit, std::string because);

/// Returns the counts of the finite `values` in `bins` equal steps from `low` to `high`; without
/// steps, as of infinite limits, all are above or below.
Histogram histogram_of(std::string title, std::string unit, const std::vector<double>& values,
                       double low, double high, std::size_t bins = 60);

/// Writes one HTML file that needs no other: pictures and charts are in it.
/// @throws Error as write_whole.
void write_html(const std::filesystem::path& path, const Report& report);

/// Writes facts, measures, tables and histograms as JSON; numbers that are not finite are null.
/// @throws Error as write_whole.
void write_json(const std::filesystem::path& path, const Report& report);

}  // namespace groundray::golden
