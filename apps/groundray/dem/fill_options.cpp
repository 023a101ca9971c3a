#include "apps/groundray/dem/fill_options.h"

#include <CLI/CLI.hpp>

#include "apps/scan/number_checks.h"
#include "apps/scan/word_option.h"

namespace groundray {

void FillLimits::add(CLI::App* command) {
  const Words<FillReach> reaches{{"enclosed", FillReach::Enclosed},
                                 {"hull", FillReach::Hull},
                                 {"everywhere", FillReach::Everywhere}};
  add_words(command, "--reach", filling.reach,
            "enclosed: holes that do not touch the edge (default); hull: within the convex hull of "
            "data; everywhere",
            reaches);
  command
      ->add_option("--farthest-m", filling.farthest_m,
                   "Skip holes that reach farther from data (50 cells)")
      ->check(positive());
  command
      ->add_option("--largest-share", filling.largest_share,
                   "Skip holes that cover a larger share of the raster (0.2)")
      ->check(CLI::Range(0.0, 1.0));
  command
      ->add_option(
          "--most-edges", most_edges,
          "For cgal: skip holes with more boundary edges (1000); time grows with their square")
      ->check(positive());
}

}  // namespace groundray
