#include "apps/groundray/dem/fill_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace groundray {
namespace {

constexpr std::array fates{HoleFate::Filled,   HoleFate::Open,     HoleFate::TooFar,
                           HoleFate::TooLarge, HoleFate::NoGround, HoleFate::Partly};

const char* sentence_of(HoleFate fate) {
  switch (fate) {
    case HoleFate::Filled:
      return "filled";
    case HoleFate::Open:
      return "left: not enclosed by data (--reach)";
    case HoleFate::TooFar:
      return "left: too far from data (--farthest-m)";
    case HoleFate::TooLarge:
      return "left: too large (--largest-share)";
    case HoleFate::NoGround:
      return "left: no measured samples beside them";
    case HoleFate::Partly:
      break;
  }
  return "left, completely or in part: the method does not reach them (for cgal: --most-edges)";
}

}  // namespace

FillTally tally_of(const FilledHeights& filled) {
  FillTally tally{.fates = {}, .trials = filled.trials};
  for (const HoleFate fate : fates) {
    FateTally of{.fate = fate};
    for (const RasterHole& hole : filled.holes) {
      if (hole.fate != fate) continue;
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
  fmt::print("{:>8} {:>12} {:>12}  result for blank areas\n", "holes", "samples", "farthest m");
  for (const FateTally& fate : tally.fates) {
    fmt::print("{:>8} {:>12} {:>12.4g}  {}\n", fate.holes, fate.samples, fate.farthest_m,
               sentence_of(fate.fate));
  }
}

void print_not_least(const FillTally& tally) {
  if (tally.not_least == 0) return;
  fmt::print(
      "{} holes are filled below their bounds, but the surface may be far from the optimum: the "
      "search was stopped early\n",
      tally.not_least);
}

const char* word_of(HoleFate fate) {
  switch (fate) {
    case HoleFate::Filled:
      return "filled";
    case HoleFate::Open:
      return "open";
    case HoleFate::TooFar:
      return "too_far";
    case HoleFate::TooLarge:
      return "too_large";
    case HoleFate::NoGround:
      return "no_ground";
    case HoleFate::Partly:
      break;
  }
  return "partly";
}

}  // namespace groundray
