#include "reconstruction/dem/fill/holdout_mask.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <utility>

namespace groundray {
namespace {

constexpr int shifts_tried = 12;
constexpr int near_cells = 6;  // margin of hidden samples in which other holes are filled as well
constexpr double least_known_share = 0.3;  // fraction of a piece that must fall on known ground
constexpr double alike = 0.8;  // sufficient ratio of the sizes of a cast shadow and the piece
constexpr int least_half_cells = 6, most_half_cells = 24;

// Returns element `number` of one of three sequences that fill [0, 1) evenly, and together a cube.
// See Roberts, The unreasonable effectiveness of quasirandom sequences (2018).
double spread(std::uint32_t number, int sequence) {
  constexpr double root = 1.2207440846057596;  // solution of x^4 = x + 1
  const double all = 0.5 + number / std::pow(root, sequence + 1);
  return all - std::floor(all);
}

}  // namespace

int roughness_reach(double distance_cells) noexcept {
  constexpr double most = 20;
  return 3 + static_cast<int>(std::ceil(std::min(1.5 * distance_cells, most)));
}

HoldoutMaskMaker::HoldoutMaskMaker(const PlateRaster& raster, std::span<const TriedHole> holes)
    : raster_(raster), holes_(holes) {
  std::size_t end = 0;
  for (const TriedHole& hole : holes) ends_.push_back(end += hole.samples.size());
}

bool HoldoutMaskMaker::is_known(glm::ivec2 sample) const noexcept {
  if (sample.x < 0 || sample.y < 0 || sample.x >= raster_.size.x || sample.y >= raster_.size.y)
    return false;
  const auto at = static_cast<std::size_t>(sample.y) * static_cast<std::size_t>(raster_.size.x) +
                  static_cast<std::size_t>(sample.x);
  return raster_.numbers[at] == plate_known;
}

HoldoutMaskMaker::Cut HoldoutMaskMaker::cut(std::uint32_t number) const {
  const auto chosen =
      static_cast<std::size_t>(spread(number, 0) * static_cast<double>(ends_.back()));
  const auto which = std::upper_bound(ends_.begin(), ends_.end() - 1, chosen) - ends_.begin();
  const auto hole_at = static_cast<std::size_t>(which);
  const TriedHole& hole = holes_[hole_at];
  const std::size_t begin = hole_at == 0 ? 0 : ends_[hole_at - 1];
  const std::uint32_t middle = hole.samples[std::min(chosen - begin, hole.samples.size() - 1)];
  const auto wide = static_cast<std::uint32_t>(raster_.size.x);
  const auto place = [wide](std::uint32_t i) {
    return glm::ivec2(static_cast<int>(i % wide), static_cast<int>(i / wide));
  };
  Cut cut;
  cut.hole = &hole;
  cut.middle = place(middle);
  cut.half_cells = std::clamp(static_cast<int>(1.5 * std::min(hole.farthest_cells, 1e6)),
                              least_half_cells, most_half_cells);
  const auto half = static_cast<std::uint32_t>(cut.half_cells);
  const std::uint32_t row = middle / wide;
  const auto first = std::ranges::lower_bound(hole.samples, (row - std::min(row, half)) * wide);
  for (auto it = first; it != hole.samples.end() && *it / wide <= row + half; ++it) {
    if (std::abs(place(*it).x - place(middle).x) <= cut.half_cells)
      cut.samples.push_back(place(*it));
  }
  return cut;
}

double HoldoutMaskMaker::known_share(const Cut& cut, glm::ivec2 shift) const {
  const std::size_t stride = cut.samples.size() / 64 + 1;
  double known = 0, all = 0;
  for (std::size_t i = 0; i < cut.samples.size(); i += stride, ++all)
    known += is_known(cut.samples[i] + shift) ? 1 : 0;
  return known / all;
}

glm::ivec2 HoldoutMaskMaker::shift(const Cut& cut, std::uint32_t number) const {
  const int range = std::max(4 * most_half_cells, 6 * cut.half_cells);
  return {std::lround((2 * spread(number, 1) - 1) * range),
          std::lround((2 * spread(number, 2) - 1) * range)};
}

// Hides the cast shadow whose size is nearest to that of the piece.
std::optional<HoldoutMask> HoldoutMaskMaker::make_shadow(const Cut& cut,
                                                         std::uint32_t number) const {
  const auto wanted = static_cast<double>(cut.samples.size());
  double best = least_known_share;
  CastShadow found;
  for (std::uint32_t i = 0; i < shifts_tried; ++i) {
    const std::uint32_t of = number * shifts_tried + i;
    const glm::ivec2 middle = cut.middle + shift(cut, of);
    const glm::ivec2 low = glm::max(middle - cut.half_cells, glm::ivec2(0));
    const glm::ivec2 high = glm::min(middle + cut.half_cells, raster_.size - 1);
    if (low.x > high.x || low.y > high.y) continue;
    CastShadow shadow = cast_shadow(raster_, *cut.hole->sight, of, low, high);
    const auto count = static_cast<double>(shadow.samples.size());
    const double share = std::min(count, wanted) / std::max(count, wanted);
    if (share <= best) continue;
    best = share;
    found = std::move(shadow);
    if (share >= alike) break;
  }
  if (found.samples.empty()) return std::nullopt;
  HoldoutMask piece = hide(found.samples, cut.hole->farthest_cells);
  piece.most_m = std::move(found.most_m);
  return piece;
}

std::optional<HoldoutMask> HoldoutMaskMaker::make(std::uint32_t number) const {
  const Cut piece = cut(number);
  if (piece.hole->sight) return make_shadow(piece, number);
  double best = least_known_share;
  std::optional<glm::ivec2> where;
  for (std::uint32_t i = 0; i < shifts_tried; ++i) {
    const glm::ivec2 tried = shift(piece, number * shifts_tried + i);
    const double share = known_share(piece, tried);
    if (share <= best) continue;
    best = share;
    where = tried;
    if (share == 1) break;
  }
  if (!where) return std::nullopt;
  std::vector<glm::ivec2> hidden;
  for (const glm::ivec2 sample : piece.samples)
    if (is_known(sample + *where)) hidden.push_back(sample + *where);
  return hide(hidden, piece.hole->farthest_cells);
}

HoldoutMask HoldoutMaskMaker::hide(const std::vector<glm::ivec2>& samples,
                                   double farthest_cells) const {
  glm::ivec2 low(raster_.size), high(-1);
  for (const glm::ivec2 at : samples) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  const int margin = roughness_reach(farthest_cells) + 3;
  const glm::ivec2 near_low = low - near_cells, near_high = high + near_cells;
  low = glm::max(low - margin, glm::ivec2(0));
  high = glm::min(high + margin, raster_.size - 1);
  HoldoutMask piece;
  piece.size = high - low + 1;
  piece.step_m = raster_.step_m;
  for (int row = low.y; row <= high.y; ++row) {
    const auto begin = static_cast<std::ptrdiff_t>(row) * raster_.size.x + low.x;
    piece.heights_m.insert(piece.heights_m.end(), raster_.heights_m.begin() + begin,
                           raster_.heights_m.begin() + begin + piece.size.x);
    for (int column = low.x; column <= high.x; ++column) {
      const bool is_near =
          near_low.x <= column && column <= near_high.x && near_low.y <= row && row <= near_high.y;
      const std::int32_t number = raster_.numbers[static_cast<std::size_t>(begin + column - low.x)];
      piece.numbers.push_back(number < 0 ? number : is_near ? 0 : plate_absent);
    }
  }
  for (const glm::ivec2 sample : samples) {
    const glm::ivec2 at = sample - low;
    const auto i = static_cast<std::uint32_t>(at.y * piece.size.x + at.x);
    piece.hidden.push_back(i);
    piece.truth_m.push_back(piece.heights_m[i]);
    piece.heights_m[i] = std::numeric_limits<float>::quiet_NaN();
    piece.numbers[i] = 0;
  }
  return piece;
}

}  // namespace groundray
