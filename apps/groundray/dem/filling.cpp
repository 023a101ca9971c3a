#include "apps/groundray/dem/filling.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>

#include "apps/groundray/command.h"
#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"
#include "core/io/print_error.h"

namespace groundray {
namespace {

// Name of a fate in files, and its description.
struct FateDescription {
  const char* word;
  const char* sentence;
};

// In the order of HoleFate.
constexpr std::array<FateDescription, 6> fates{{
    {"filled", "filled"},
    {"open", "left: not enclosed by data (--reach)"},
    {"too_far", "left: too far from data (--farthest-m)"},
    {"too_large", "left: too large (--largest-share)"},
    {"no_ground", "left: no measured samples beside them"},
    {"partly",
     "left, completely or in part: the method does not reach them (for cgal: --most-edges)"},
}};

const FateDescription& description_of(HoleFate fate) {
  return fates[static_cast<std::size_t>(fate)];
}

}  // namespace

void FillLimits::add(CLI::App* command) {
  const Words<FillReach> reaches{{"enclosed", FillReach::Enclosed},
                                 {"hull", FillReach::Hull},
                                 {"everywhere", FillReach::Everywhere}};
  add_words(command, "--reach", filling.reach,
            "enclosed: holes that do not touch the edge (default); hull: within the convex hull of "
            "data; everywhere",
            reaches);
  add_number(command, "--farthest-m", filling.farthest_m, positive(),
             "Skip holes that reach farther from data (50 cells)");
  add_number(command, "--largest-share", filling.largest_share, CLI::Range(0.0, 1.0),
             "Skip holes that cover a larger share of the raster (0.2)");
  add_number(command, "--most-edges", most_edges, positive(),
             "For cgal: skip holes with more boundary edges (1000); time grows with their square");
}

FillTally tally_of(const FilledHeights& filled) {
  FillTally tally;
  for (std::size_t i = 0; i < fates.size(); ++i) {
    FateTally of{.fate = static_cast<HoleFate>(i)};
    for (const RasterHole& hole : filled.holes) {
      if (hole.fate != of.fate) continue;
      ++of.holes;
      of.samples += hole.samples;
      of.farthest_m = std::max(of.farthest_m, hole.farthest_m);
      tally.at_bound += hole.at_bound;
      tally.not_least += hole.is_least ? 0 : 1;
    }
    if (of.holes > 0) tally.fates.push_back(of);
  }
  return tally;
}

void print_fates(const FillTally& tally) {
  if (tally.fates.empty()) return;
  print_text(stdout, "{:>8} {:>12} {:>12}  result for blank areas\n", "holes", "samples",
             "farthest m");
  for (const FateTally& fate : tally.fates) {
    print_text(stdout, "{:>8} {:>12} {:>12.4g}  {}\n", fate.holes, fate.samples, fate.farthest_m,
               description_of(fate.fate).sentence);
  }
}

void print_not_least(const FillTally& tally) {
  if (tally.not_least == 0) return;
  print_text(
      stdout,
      "{} holes are filled below their bounds, but the surface may be far from the optimum: the "
      "search was stopped early\n",
      tally.not_least);
}

const char* word_of(HoleFate fate) { return description_of(fate).word; }

}  // namespace groundray
