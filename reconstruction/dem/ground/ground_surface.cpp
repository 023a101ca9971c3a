#include "reconstruction/dem/ground/ground_surface.h"

#include <tbb/parallel_for.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <tuple>

#include "core/math.h"

namespace groundray {
namespace {

struct Lowest {
  static constexpr float none = std::numeric_limits<float>::infinity();
  static float of(float a, float b) noexcept { return b < a ? b : a; }
};

struct Highest {
  static constexpr float none = -std::numeric_limits<float>::infinity();
  static float of(float a, float b) noexcept { return a < b ? b : a; }
};

// Extremes of all runs of 2^k cells of one row, for k = 0, 1, ...: run i of level k begins at cell
// i - margin. The extreme of any run is that of two overlapping ones of these.
template <typename Extreme>
class RowRuns {
 public:
  RowRuns(int columns, int margin)
      : length_(static_cast<std::size_t>(columns) + 2 * static_cast<std::size_t>(margin)),
        margin_(static_cast<std::size_t>(margin)),
        levels_(static_cast<std::size_t>(std::bit_width(2 * margin_ + 1))),
        runs_(length_ * levels_, Extreme::none) {}

  void fill(const float* row) noexcept {
    std::copy_n(row, length_ - 2 * margin_, runs_.data() + margin_);
    for (std::size_t k = 1; k < levels_; ++k) {
      const std::size_t half = std::size_t{1} << (k - 1);
      const float* from = runs_.data() + (k - 1) * length_;
      float* to = runs_.data() + k * length_;
      for (std::size_t i = 0; i + half < length_; ++i) to[i] = Extreme::of(from[i], from[i + half]);
    }
  }

  // Merges into each cell of `into` the extreme of the cells at most `reach` columns away.
  void merge(int reach, float* into) const noexcept {
    const auto width = 2 * static_cast<std::size_t>(reach) + 1;
    const auto level = static_cast<std::size_t>(std::bit_width(width) - 1);
    const float* first = runs_.data() + level * length_ + margin_ - static_cast<std::size_t>(reach);
    const float* second = first + width - (std::size_t{1} << level);
    const std::size_t columns = length_ - 2 * margin_;
    for (std::size_t i = 0; i < columns; ++i)
      into[i] = Extreme::of(into[i], Extreme::of(first[i], second[i]));
  }

 private:
  std::size_t length_, margin_, levels_;
  std::vector<float> runs_;
};

// Returns the half-width of the disc in each row, by the row's distance from the centre.
std::vector<int> half_widths(int radius) {
  std::vector<int> widths;
  for (int dy = 0; dy <= radius; ++dy) {
    int width = 0;
    while ((width + 1) * (width + 1) + dy * dy <= radius * radius) ++width;
    widths.push_back(width);
  }
  return widths;
}

template <typename Extreme>
Raster extremes(const Raster& surface, const std::vector<int>& widths) {
  const int radius = static_cast<int>(widths.size()) - 1;
  Raster result(surface.size, Extreme::none);
  const int strip = std::max(32, 2 * radius);
  const int strips = (surface.size.y + strip - 1) / strip;
  tbb::parallel_for(0, strips, [&](int number) {
    RowRuns<Extreme> runs(surface.size.x, radius);
    const int begin = number * strip, end = std::min(begin + strip, surface.size.y);
    for (int y = std::max(0, begin - radius); y < std::min(surface.size.y, end + radius); ++y) {
      runs.fill(surface.row(y));
      for (int to = std::max(begin, y - radius); to < std::min(end, y + radius + 1); ++to)
        runs.merge(widths[static_cast<std::size_t>(std::abs(to - y))], result.row(to));
    }
  });
  return result;
}

// Merges blocks of four cells into one, with the mean of their points.
SurfacePins coarser(const SurfacePins& fine) {
  const glm::ivec2 size = (fine.height_m.size + 1) / 2;
  SurfacePins coarse(size);
  tbb::parallel_for(0, size.y, [&](int row) {
    for (int column = 0; column < size.x; ++column) {
      float count = 0, height = 0, right = 0, up = 0;
      for (int y = 2 * row; y < std::min(2 * row + 2, fine.height_m.size.y); ++y) {
        for (int x = 2 * column; x < std::min(2 * column + 2, fine.height_m.size.x); ++x) {
          if (std::isnan(fine.height_m(x, y))) continue;
          ++count;
          height += fine.height_m(x, y);
          right += fine.right_cells(x, y) + static_cast<float>(x - 2 * column) - 0.5f;
          up += fine.up_cells(x, y) + static_cast<float>(y - 2 * row) - 0.5f;
        }
      }
      if (count == 0) continue;
      coarse.height_m(column, row) = height / count;
      coarse.right_cells(column, row) = 0.5f * right / count;
      coarse.up_cells(column, row) = 0.5f * up / count;
    }
  });
  return coarse;
}

// Interpolates the coarse surface at the centres of the finer cells. In cells with a point, it
// serves to carry the point's height to the centre.
Raster refined(const Raster& coarse, const SurfacePins& pins, PinPlace place) {
  Raster surface(pins.height_m.size);
  tbb::parallel_for(0, surface.size.y, [&](int row) {
    for (int column = 0; column < surface.size.x; ++column) {
      const float x = 0.5f * static_cast<float>(column) - 0.25f,
                  y = 0.5f * static_cast<float>(row) - 0.25f;
      const std::size_t i = surface.index(column, row);
      const float pin = pins.height_m.values[i];
      float& height = surface.values[i];
      if (std::isnan(pin)) {
        height = between_cells(coarse, x, y);
      } else if (place == PinPlace::Middle) {
        height = pin;
      } else {
        height = pin + between_cells(coarse, x, y) -
                 between_cells(coarse, x + 0.5f * pins.right_cells.values[i],
                               y + 0.5f * pins.up_cells.values[i]);
      }
    }
  });
  return surface;
}

// Moves each cell without a point towards the mean of its neighbours, in checkerboard order.
void relax(const SurfacePins& pins, float beyond, Raster& surface) {
  const glm::ivec2 size = surface.size;
  for (const int colour : {0, 1}) {
    tbb::parallel_for(0, size.y, [&](int row) {
      for (int column = (row + colour) & 1; column < size.x; column += 2) {
        const std::size_t i = surface.index(column, row);
        if (!std::isnan(pins.height_m.values[i])) continue;
        float sum = 0, count = 0;
        const auto add = [&](bool is_there, int x, int y) {
          if (!is_there) return;
          sum += surface(x, y);
          ++count;
        };
        add(column > 0, column - 1, row);
        add(column + 1 < size.x, column + 1, row);
        add(row > 0, column, row - 1);
        add(row + 1 < size.y, column, row + 1);
        if (count > 0) surface.values[i] += beyond * (sum / count - surface.values[i]);
      }
    });
  }
}

constexpr float no_height = std::numeric_limits<float>::quiet_NaN();

// Returns the radii of the discs up to the widest: each larger than the last by a cell or a tenth,
// so that fine cells do not need hundreds of discs.
std::vector<int> growing_radii(int widest) {
  std::vector<int> radii;
  for (int radius = 1; radius < widest; radius += std::max(1, radius / 10)) radii.push_back(radius);
  if (widest > 0) radii.push_back(widest);
  return radii;
}

int cells_of(double length_m, const GroundFilterOptions& options) {
  return static_cast<int>(std::ceil(length_m / options.cell_m));
}

// Removes points below all their neighbours, where a closing by a disc of one cell raises the
// surface by more than `depth_m`. Returns their number.
std::size_t drop_pits(const Raster& surface, float depth_m, SurfacePins& pins) {
  const Raster closed = closed_by_disc(surface, 1);
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.values.size(); ++i) {
    float& pin = pins.height_m.values[i];
    if (std::isnan(pin) || closed.values[i] - surface.values[i] <= depth_m) continue;
    pin = no_height;
    ++count;
  }
  return count;
}

// Lowers the surface along the lines of a net to its opening by a disc of twice their spacing,
// where that is lower by more than the slope allows. Features wider than all discs thus fall into
// pieces that are not. Removes the points there and returns their number.
std::size_t cut_by_net(const GroundFilterOptions& options, Raster& surface, SurfacePins& pins) {
  std::size_t count = 0;
  const int spacing = cells_of(options.net_m, options), radius = 2 * spacing;
  const Raster opened = opened_by_disc(surface, radius);
  const auto most_m = static_cast<float>(options.slope * radius * options.cell_m);
  for (int row = 0; row < surface.size.y; ++row) {
    for (int column = 0; column < surface.size.x; ++column) {
      if (row % spacing != 0 && column % spacing != 0) continue;
      if (surface(column, row) - opened(column, row) <= most_m) continue;
      surface(column, row) = opened(column, row);
      float& pin = pins.height_m(column, row);
      count += static_cast<std::size_t>(!std::isnan(pin));
      pin = no_height;
    }
  }
  return count;
}

// Marks the cells that a disc lowers by more than the slope allows over its radius, compared with
// the previous disc.
std::vector<std::uint8_t> objects_on(Raster surface, const GroundFilterOptions& options,
                                     const std::function<void(double)>& progress) {
  std::vector<std::uint8_t> is_object(surface.values.size(), 0);
  const std::vector<int> radii = growing_radii(cells_of(options.window_radius_m, options));
  double done = 0, all = 0;
  for (const int radius : radii) all += radius;
  for (const int radius : radii) {
    Raster opened = opened_by_disc(surface, radius);
    const auto most_m = static_cast<float>(options.slope * radius * options.cell_m);
    for (std::size_t i = 0; i < is_object.size(); ++i)
      is_object[i] |= static_cast<std::uint8_t>(surface.values[i] - opened.values[i] > most_m);
    surface = std::move(opened);
    progress((done += radius) / all);
  }
  return is_object;
}

Raster slope_of(const Raster& height_m, double cell_m) {
  const glm::ivec2 size = height_m.size;
  Raster slope(size);
  tbb::parallel_for(0, size.y, [&](int row) {
    const int below = std::max(row - 1, 0), above = std::min(row + 1, size.y - 1);
    for (int column = 0; column < size.x; ++column) {
      const int left = std::max(column - 1, 0), right = std::min(column + 1, size.x - 1);
      const auto rise = [&](float first, float second, int cells) {
        return cells == 0 ? 0 : (second - first) / (cells * cell_m);
      };
      slope(column, row) = static_cast<float>(
          math::hypot(rise(height_m(left, row), height_m(right, row), right - left),
                      rise(height_m(column, below), height_m(column, above), above - below)));
    }
  });
  return slope;
}

}  // namespace

Raster opened_by_disc(const Raster& surface, int radius_cells) {
  const std::vector<int> widths = half_widths(radius_cells);
  return extremes<Highest>(extremes<Lowest>(surface, widths), widths);
}

Raster closed_by_disc(const Raster& surface, int radius_cells) {
  const std::vector<int> widths = half_widths(radius_cells);
  return extremes<Lowest>(extremes<Highest>(surface, widths), widths);
}

Raster membrane_through(const SurfacePins& pins, PinPlace place) {
  constexpr int sweeps = 8;
  constexpr float beyond = 1.3f;    // of the way to the mean: over-relaxation converges sooner
  std::vector<SurfacePins> levels;  // from fine to coarse
  const SurfacePins* last = &pins;
  while (last->height_m.size.x > 1 || last->height_m.size.y > 1) {
    levels.push_back(coarser(*last));
    last = &levels.back();
  }
  Raster surface = last->height_m;  // one cell
  for (std::size_t level = levels.size(); level-- > 0;) {
    const SurfacePins& finer = level == 0 ? pins : levels[level - 1];
    // Means of several points apply at their mean positions.
    surface = refined(surface, finer, level == 0 ? place : PinPlace::Measured);
    for (int sweep = 0; sweep < sweeps; ++sweep) relax(finer, beyond, surface);
  }
  return surface;
}

SurfacePins lowest_points(std::span<const glm::dvec3> points_m, const CellFrame& frame) {
  constexpr std::uint32_t nobody = std::numeric_limits<std::uint32_t>::max();
  SurfacePins pins(frame.cells);
  std::vector<std::uint32_t> lowest(pins.height_m.values.size(), nobody);
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const glm::dvec3& p = points_m[i];
    // Rounding may put points on the frame's edge outside it.
    const glm::dvec2 at =
        glm::clamp(frame.from_first(p) + 0.5, glm::dvec2(0), glm::dvec2(frame.cells - 1));
    const int column = static_cast<int>(at.x), row = static_cast<int>(at.y);
    std::uint32_t& best = lowest[pins.height_m.index(column, row)];
    if (best != nobody) {
      const glm::dvec3& q = points_m[best];
      if (!(std::tie(p.z, p.x, p.y) < std::tie(q.z, q.x, q.y))) continue;
    }
    best = static_cast<std::uint32_t>(i);
  }
  tbb::parallel_for(0, frame.cells.y, [&](int row) {
    for (int column = 0; column < frame.cells.x; ++column) {
      const std::size_t cell = pins.height_m.index(column, row);
      if (lowest[cell] == nobody) continue;
      const glm::dvec3& p = points_m[lowest[cell]];
      const glm::dvec2 at = frame.from_first(p) - glm::dvec2(column, row);
      pins.height_m.values[cell] = static_cast<float>(p.z);
      pins.right_cells.values[cell] = static_cast<float>(at.x);
      pins.up_cells.values[cell] = static_cast<float>(at.y);
    }
  });
  return pins;
}

GroundSurface ground_below(SurfacePins lowest, const GroundFilterOptions& options,
                           const std::function<void(double)>& progress) {
  GroundSurface ground;
  Raster surface = membrane_through(lowest, PinPlace::Middle);
  ground.pit_cells =
      drop_pits(surface, static_cast<float>(options.pit_slope * options.cell_m), lowest);
  if (ground.pit_cells > 0) surface = membrane_through(lowest, PinPlace::Middle);
  progress(0.2);
  if (options.net_m > 0) ground.object_cells = cut_by_net(options, surface, lowest);
  const std::vector<std::uint8_t> is_object =
      objects_on(std::move(surface), options, [&](double share) { progress(0.2 + 0.6 * share); });
  for (std::size_t i = 0; i < is_object.size(); ++i) {
    if (is_object[i] == 0 || std::isnan(lowest.height_m.values[i])) continue;
    lowest.height_m.values[i] = no_height;
    ++ground.object_cells;
  }
  ground.height_m = membrane_through(lowest, PinPlace::Measured);
  ground.slope = slope_of(ground.height_m, options.cell_m);
  progress(1);
  return ground;
}

}  // namespace groundray
