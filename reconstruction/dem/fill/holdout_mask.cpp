#include "reconstruction/dem/fill/holdout_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/math.h"
#include "reconstruction/dem/fill/fill_error_model.h"

namespace groundray {
namespace {

constexpr double least_bounded = 0.5;  // fraction of a hole's samples
constexpr double most_above = 0.5;     // fraction of the height that lines lose over a hole
constexpr int approach = 2;  // search distance for ground that casts shadows on a box, in boxes

constexpr std::array<glm::ivec2, 8> ways{{{1, 0},
                                          {1, 1},
                                          {0, 1},
                                          {-1, 1},  //
                                          {-1, 0},
                                          {-1, -1},
                                          {0, -1},
                                          {1, -1}}};

glm::dvec2 in_metres(const ThinPlateRaster& raster, glm::ivec2 way) {
  return glm::dvec2(way) * glm::abs(raster.step_m);
}

// Returns the index of the direction nearest to `ahead`.
std::size_t way_along(const ThinPlateRaster& raster, glm::dvec2 ahead) {
  const auto along = [&](glm::ivec2 way) {
    return glm::dot(glm::normalize(in_metres(raster, way)), ahead);
  };
  return static_cast<std::size_t>(std::ranges::max_element(ways, {}, along) - ways.begin());
}

// Returns the mean gradient of bounds along columns and rows, m/m; nothing if too few neighbours
// have bounds.
std::optional<glm::dvec2> mean_rise(const ThinPlateRaster& raster, std::span<const float> most_m,
                                    std::span<const std::uint32_t> hole) {
  glm::dvec2 sum_m(0), count(0);
  for (const std::uint32_t sample : hole) {
    const glm::ivec2 at = raster.place(sample);
    for (const int k : {0, 1}) {
      const glm::ivec2 next = at + glm::ivec2(k == 0, k == 1);
      if (!raster.contains(next) || raster.is_known(next)) continue;
      const double rise_m = double{most_m[raster.index(next)]} - most_m[sample];
      if (std::isnan(rise_m)) continue;
      sum_m[k] += rise_m;
      count[k] += 1;
    }
  }
  if (count.x == 0 || count.y == 0) return std::nullopt;
  return sum_m / (count * glm::abs(raster.step_m));
}

// Height, at each sample of a box, of the line of sight that just clears the ground before it.
class Lines {
 public:
  Lines(const ThinPlateRaster& raster, glm::ivec2 way, double fall_m, glm::ivec2 low,
        glm::ivec2 high)
      : first_(low),
        size_(high - low + 1),
        lines_m_(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y)) {
    for (int j = 0; j < size_.y; ++j) {
      for (int i = 0; i < size_.x; ++i) {
        const glm::ivec2 at =
            low + glm::ivec2(way.x < 0 ? size_.x - 1 - i : i, way.y < 0 ? size_.y - 1 - j : j);
        const glm::ivec2 before = at - way;
        double line_m = -std::numeric_limits<double>::infinity();
        if (glm::clamp(before, low, high) == before) {
          line_m = at_m(before);
          if (raster.is_known(before))
            line_m = std::max(line_m, double{raster.heights_m[raster.index(before)]});
        }
        lines_m_[index(at)] = line_m - fall_m;
      }
    }
  }

  double at_m(glm::ivec2 at) const { return lines_m_[index(at)]; }

 private:
  std::size_t index(glm::ivec2 at) const {
    const glm::ivec2 place = at - first_;
    return static_cast<std::size_t>(place.y) * static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(place.x);
  }

  glm::ivec2 first_, size_;
  std::vector<double> lines_m_;
};

constexpr int shifts_tried = 12;
constexpr int near_cells = 6;  // margin of hidden samples in which other holes are filled as well
constexpr double least_known_share = 0.3;  // fraction of a piece that must fall on known ground
constexpr double alike = 0.8;  // sufficient ratio of the sizes of a cast shadow and the piece
constexpr int least_half_cells = 6, most_half_cells = 24;

// Returns element `number` of one of three sequences that fill [0, 1) evenly, and together a cube.
// See Roberts, The unreasonable effectiveness of quasirandom sequences (2018).
double spread(std::uint32_t number, int sequence) {
  constexpr double root = 1.2207440846057596;  // solution of x^4 = x + 1
  const double all = 0.5 + number / math::pow(root, sequence + 1);
  return all - std::floor(all);
}

}  // namespace

std::optional<GrazingSight> sight_over(const ThinPlateRaster& raster, std::span<const float> most_m,
                                       std::span<const std::uint32_t> hole) {
  const auto rise = mean_rise(raster, most_m, hole);
  if (!rise || !(glm::length(*rise) > 0)) return std::nullopt;
  GrazingSight sight{.ahead = -glm::normalize(*rise), .fall = glm::length(*rise)};
  const glm::ivec2 way = ways[way_along(raster, sight.ahead)];
  const double step_m = glm::length(in_metres(raster, way));
  double bounded = 0, first = 0;
  for (const std::uint32_t sample : hole) {
    if (std::isnan(most_m[sample])) continue;
    bounded += 1;
    const glm::ivec2 before = raster.place(sample) - way;
    if (!raster.is_known(before)) continue;
    first += 1;
    const double above_m =
        most_m[sample] + sight.fall * step_m - raster.heights_m[raster.index(before)];
    sight.above_m += std::fmax(above_m, 0);
  }
  if (first == 0 || bounded < least_bounded * static_cast<double>(hole.size())) return std::nullopt;
  sight.above_m /= first;
  if (sight.above_m > most_above * sight.fall * step_m * bounded / first) return std::nullopt;
  return sight;
}

CastShadow cast_shadow(const ThinPlateRaster& raster, const GrazingSight& sight, std::uint32_t turn,
                       glm::ivec2 low, glm::ivec2 high) {
  constexpr std::array<std::size_t, 5> turns{4, 3, 5, 2, 6};  // eighths of a full turn
  const glm::ivec2 way = ways[(way_along(raster, sight.ahead) + turns[turn % turns.size()]) % 8];
  const glm::ivec2 far = approach * (high - low + 1) * way;
  const Lines lines(raster, way, sight.fall * glm::length(in_metres(raster, way)),
                    glm::max(low - glm::max(far, glm::ivec2(0)), glm::ivec2(0)),
                    glm::min(high - glm::min(far, glm::ivec2(0)), raster.size - 1));
  CastShadow shadow;
  for (int row = low.y; row <= high.y; ++row) {
    for (int column = low.x; column <= high.x; ++column) {
      const glm::ivec2 at(column, row);
      if (!raster.is_known(at) || !(lines.at_m(at) > raster.heights_m[raster.index(at)])) continue;
      shadow.samples.push_back(at);
      shadow.most_m.push_back(static_cast<float>(lines.at_m(at) + sight.above_m));
    }
  }
  return shadow;
}

HoldoutMaskMaker::HoldoutMaskMaker(const ThinPlateRaster& raster, std::span<const TriedHole> holes)
    : raster_(raster), holes_(holes) {
  std::size_t end = 0;
  for (const TriedHole& hole : holes) ends_.push_back(end += hole.samples.size());
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
  Cut cut;
  cut.hole = &hole;
  cut.middle = raster_.place(middle);
  cut.half_cells = std::clamp(static_cast<int>(1.5 * std::min(hole.farthest_cells, 1e6)),
                              least_half_cells, most_half_cells);
  const auto half = static_cast<std::uint32_t>(cut.half_cells);
  const std::uint32_t row = middle / wide;
  const auto first = std::ranges::lower_bound(hole.samples, (row - std::min(row, half)) * wide);
  for (auto it = first; it != hole.samples.end() && *it / wide <= row + half; ++it) {
    const glm::ivec2 at = raster_.place(*it);
    if (std::abs(at.x - cut.middle.x) <= cut.half_cells) cut.samples.push_back(at);
  }
  return cut;
}

double HoldoutMaskMaker::known_share(const Cut& cut, glm::ivec2 shift) const {
  const std::size_t stride = cut.samples.size() / 64 + 1;
  double known = 0, all = 0;
  for (std::size_t i = 0; i < cut.samples.size(); i += stride, ++all)
    known += raster_.is_known(cut.samples[i] + shift) ? 1 : 0;
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
    if (raster_.is_known(sample + *where)) hidden.push_back(sample + *where);
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
      piece.numbers.push_back(number < 0 ? number : is_near ? 0 : absent_sample);
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
