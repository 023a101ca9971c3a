#include "terrain/lod/clipmap.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <span>
#include <utility>

#include "core/error.h"
#include "terrain/dem/row_major.h"
#include "terrain/lod/quadtree.h"

namespace groundray {

namespace {

constexpr int unit_nodes = 2;  // windows are aligned to nodes of the next coarser level
// Small enough that moving a window rebuilds little, large enough for efficient tracing.
constexpr int part_cells = 32;
constexpr int unit_cells = unit_nodes * Certificate::block_cells;
constexpr int smallest_half = 2;  // least distance from the viewpoint to a window's side, units

int ceil_div(int a, int b) { return (a + b - 1) / b; }

// Copies the values of a tile that lie in a rectangle. Rows of a tile have `pitch` values; tile t
// begins with the value at `t * span`.
void assemble(const float* from, glm::ivec2 tile, int span, int pitch, glm::ivec2 first,
              glm::ivec2 size, std::vector<float>& out) {
  const glm::ivec2 low = glm::max(tile * span, first);
  const glm::ivec2 high = glm::min(tile * span + pitch, first + size);
  for (int row = low.y; row < high.y; ++row) {
    const float* begin =
        from + static_cast<std::ptrdiff_t>(row - tile.y * span) * pitch + (low.x - tile.x * span);
    std::copy_n(
        begin, std::max(0, high.x - low.x),
        out.begin() + static_cast<std::ptrdiff_t>(row - first.y) * size.x + (low.x - first.x));
  }
}

}  // namespace

struct Clipmap::Plan {
  std::shared_ptr<const TileSource> source;
  GridFrame frame;
  ClipmapSettings settings;
  Lattice lattice;
  int finest = 0;                  // finest level with a window
  int outermost = 0;               // level whose window is the whole DEM
  std::vector<glm::ivec2> half;    // units from the viewpoint to the sides of each level's window
  std::vector<NodeLevel> coarser;  // all nodes of the levels above the outermost

  Plan(std::shared_ptr<const TileSource> from, const GridFrame& grid,
       const ClipmapSettings& chosen);
  bool is_needed(int level) const;
  glm::ivec2 wanted_half(int level) const;
  void size_windows(int most_units);
  double cells(int level) const;
  double bytes() const;
  bool has_quads() const;
  Rectangle window(int level, const glm::dvec2& centre) const;
  glm::dvec2 centre(const SensorBox& sensors) const;
  MeshBound bound(const SensorBox& sensors) const;
};

namespace {

// Assembles the nodes of a rectangle from the tiles that `tile_at` returns.
NodeLevel assemble_nodes(const Rectangle& where, const auto& tile_at) {
  NodeLevel nodes;
  nodes.size = where.end - where.first;
  const auto copy = [&](const Tile::NodeValues& from, glm::ivec2 tile, std::vector<float>& to) {
    to.resize(value_count(nodes.size));
    assemble(from.data(), tile, Tile::nodes, Tile::nodes, where.first, nodes.size, to);
  };
  for (int y = where.first.y / Tile::nodes; y <= (where.end.y - 1) / Tile::nodes; ++y) {
    for (int x = where.first.x / Tile::nodes; x <= (where.end.x - 1) / Tile::nodes; ++x) {
      const Tile& tile = tile_at(glm::ivec2(x, y));
      copy(tile.key_m, {x, y}, nodes.key_m);
      copy(tile.deviation_m, {x, y}, nodes.deviation_m);
      copy(tile.full_m, {x, y}, nodes.full_m);
      copy(tile.low_m, {x, y}, nodes.low_m);
      copy(tile.high_m, {x, y}, nodes.high_m);
    }
  }
  return nodes;
}

void check_settings(const ClipmapSettings& settings) {
  const auto is_length = [](double value) { return value >= 0 && std::isfinite(value); };
  Violations broken("terrain levels");
  broken.unless(is_length(settings.tolerance_m), "tolerance = {} m must be finite and not negative",
                settings.tolerance_m);
  broken.unless(is_length(settings.angle_rad),
                "angular tolerance = {} rad must be finite and not negative", settings.angle_rad);
  broken.unless(is_length(settings.reach_m), "reach = {} m must be finite and not negative",
                settings.reach_m);
  broken.throw_if_any();
}

}  // namespace

Clipmap::Plan::Plan(std::shared_ptr<const TileSource> from, const GridFrame& grid,
                    const ClipmapSettings& chosen)
    : source(std::move(from)), frame(grid), settings(chosen), lattice(source->lattice()) {
  check_settings(settings);
  int units = ceil_div(std::max(lattice.cells(0).x, lattice.cells(0).y), unit_cells);
  size_windows(units);
  while (bytes() > static_cast<double>(settings.memory_bytes)) {
    if (units <= smallest_half) {
      throw Error(
          "terrain levels: {:.0f} MiB are too few for the smallest windows, which take {:.0f}; "
          "allow more memory",
          static_cast<double>(settings.memory_bytes) / (1 << 20), bytes() / (1 << 20));
    }
    units = std::max(smallest_half, std::min(units - 1, units * 15 / 16));
    size_windows(units);
  }
  for (int level = outermost + 1; level <= lattice.top_level(); ++level) {
    std::shared_ptr<const Tile> tile;
    coarser.push_back(
        assemble_nodes({{0, 0}, lattice.nodes(level)}, [&](glm::ivec2 which) -> const Tile& {
          tile = source->tile({level, which});
          return *tile;
        }));
  }
}

// Returns whether a node of the next level may exceed the tolerance, so that it has to be split.
bool Clipmap::Plan::is_needed(int level) const {
  const bool all = settings.tolerance_m == 0 && settings.angle_rad == 0;
  const int parent = std::min(level + 1, lattice.top_level());
  return all || source->max_key_m(parent) > settings.tolerance_m;
}

// Returns the distance from the viewpoint, in units, within which nodes of the next level have to
// be split: their largest key divided by the angle, plus the reach. Five units are added: two for
// the widened box of the sensors, one for the nodes' own size, one for leaves that must not be
// thinned, and one for alignment.
glm::ivec2 Clipmap::Plan::wanted_half(int level) const {
  constexpr int everywhere = 1 << 28;
  if (settings.angle_rad == 0) return glm::ivec2(everywhere);
  const double key_m = source->max_key_m(std::min(level + 1, lattice.top_level()));
  const double radius_m = key_m / settings.angle_rad + settings.reach_m;
  const glm::dvec2 unit_m = glm::abs(frame.step_m) * static_cast<double>(unit_cells << level);
  const glm::dvec2 units = glm::ceil(radius_m / unit_m) + 5.0;
  return glm::max(glm::ivec2(glm::min(units, glm::dvec2(everywhere))), smallest_half);
}

void Clipmap::Plan::size_windows(int most_units) {
  finest = 0;
  while (finest < lattice.top_level() && !is_needed(finest)) ++finest;
  half.assign(static_cast<std::size_t>(finest), glm::ivec2(0));
  for (int level = finest;; ++level) {
    outermost = level;
    const glm::ivec2 whole =
        (lattice.cells(level) - 1) / unit_cells + 1;  // from one side of the DEM to the other
    glm::ivec2 units = glm::min(wanted_half(level), glm::ivec2((most_units + 1) / 2));
    if (level > finest) units = glm::max(units, (half.back() + 3 + 1) / 2);
    half.push_back(units);
    if (level == lattice.top_level() || glm::all(glm::lessThanEqual(whole, units)) ||
        glm::all(glm::lessThanEqual(whole, glm::ivec2(most_units)))) {
      half.back() = whole;
      return;
    }
  }
}

// Returns the number of cells of a window at its largest.
double Clipmap::Plan::cells(int level) const {
  const glm::dvec2 side = glm::min(2 * unit_cells * half[static_cast<std::size_t>(level)],
                                   lattice.cells(level) + unit_cells);
  return side.x * side.y;
}

// Returns the memory of the windows at their largest.
double Clipmap::Plan::bytes() const {
  double all = 0;
  for (int level = finest; level <= outermost; ++level) all += cells(level);
  return all * grid_cell_bytes;
}

// Returns whether the memory suffices for quads in the innermost window.
bool Clipmap::Plan::has_quads() const {
  return bytes() + cells(finest) * (quad_cell_bytes - grid_cell_bytes) <=
         static_cast<double>(settings.memory_bytes);
}

glm::dvec2 Clipmap::Plan::centre(const SensorBox& sensors) const {
  const glm::dvec2 middle =
      frame.to_grid((glm::dvec2(sensors.low_m) + glm::dvec2(sensors.high_m)) / 2.0);
  return glm::clamp(middle, glm::dvec2(0), glm::dvec2(frame.samples - 1));
}

Rectangle Clipmap::Plan::window(int level, const glm::dvec2& centre) const {
  const glm::ivec2 nodes = lattice.nodes(level);
  if (level == outermost) return {{0, 0}, nodes};
  const glm::ivec2 middle(glm::round(centre / static_cast<double>(unit_cells << level)));
  const glm::ivec2 units = half[static_cast<std::size_t>(level)];
  return {glm::max((middle - units) * unit_nodes, 0),
          glm::min((middle + units) * unit_nodes, nodes)};
}

// The box is widened to the alignment of the windows, so that small movements of the sensors change
// nothing.
MeshBound Clipmap::Plan::bound(const SensorBox& sensors) const {
  MeshBound bound = bound_from(sensors, frame, settings.tolerance_m, settings.angle_rad);
  bound.widened_to_nodes = unit_nodes;
  return bound;
}

// Tiles of a level, and the arrays assembled from them. Tiles that are a multiple of the window's
// width apart share a slot, so that a tile that stays in view keeps its slot.
struct Clipmap::Window {
  struct Slot {
    glm::ivec2 tile{-1};
    std::shared_ptr<const Tile> content;
  };
  int level = 0;
  Rectangle nodes_in;
  glm::ivec2 slots{0};
  std::vector<Slot> tiles;
  NodeLevel nodes;
  HeightArray heights;

  Window(const Plan& plan, int level, const Rectangle& where, const Window* before);
  static glm::ivec2 first_tile(const Rectangle& where) { return where.first / Tile::nodes; }
  static glm::ivec2 last_tile(const Rectangle& where) { return (where.end - 1) / Tile::nodes; }
  Slot& slot(glm::ivec2 tile) {
    return tiles[static_cast<std::size_t>(tile.y % slots.y) * static_cast<std::size_t>(slots.x) +
                 static_cast<std::size_t>(tile.x % slots.x)];
  }
  std::vector<float> assemble_heights(const Plan& plan);
  glm::ivec2 first_point() const { return nodes_in.first * Certificate::block_cells; }
  glm::ivec2 points(const Lattice& lattice) const {
    return glm::min(nodes_in.end * Certificate::block_cells + 1, lattice.points(level)) -
           first_point();
  }

 private:
  HeightArray fill(const Plan& plan, const Window* before);
};

Clipmap::Window::Window(const Plan& plan, int of, const Rectangle& where, const Window* before)
    : level(of), nodes_in(where), heights(fill(plan, before)) {
  nodes =
      assemble_nodes(nodes_in, [&](glm::ivec2 tile) -> const Tile& { return *slot(tile).content; });
}

HeightArray Clipmap::Window::fill(const Plan& plan, const Window* before) {
  const glm::ivec2 all = tile_count(plan.lattice, level);
  const glm::ivec2 widest = 2 * plan.half[static_cast<std::size_t>(level)] * unit_nodes;
  slots = glm::min(all, (widest - 1) / Tile::nodes + 2);
  tiles = before != nullptr ? before->tiles : std::vector<Slot>(value_count(slots));
  const glm::ivec2 first = first_tile(nodes_in), last = last_tile(nodes_in);
  for (Slot& old : tiles) {
    if (glm::any(glm::lessThan(old.tile, first)) || glm::any(glm::greaterThan(old.tile, last)))
      old = {};
  }
  for (int y = first.y; y <= last.y; ++y) {
    for (int x = first.x; x <= last.x; ++x) {
      Slot& here = slot({x, y});
      if (here.content == nullptr) here = {{x, y}, plan.source->tile({level, {x, y}})};
    }
  }
  return {points(plan.lattice), assemble_heights(plan)};
}

std::vector<float> Clipmap::Window::assemble_heights(const Plan& plan) {
  const glm::ivec2 size = points(plan.lattice);
  std::vector<float> out(value_count(size));
  for (const Slot& slot : tiles) {
    if (slot.content == nullptr) continue;
    assemble(slot.content->heights_m.data(), slot.tile, Tile::cells, Tile::points, first_point(),
             size, out);
  }
  return out;
}

Clipmap::Clipmap(std::shared_ptr<const TileSource> source, const GridFrame& frame,
                 const ClipmapSettings& settings, const SensorBox& sensors,
                 const PassRunner& runner)
    : Clipmap(std::make_shared<const Plan>(std::move(source), frame, settings), sensors, nullptr,
              runner) {}

Clipmap Clipmap::moved_to(const SensorBox& sensors, const PassRunner& runner) const {
  Clipmap next(plan_, sensors, this, runner);
  const glm::dvec2 here = plan_->centre(sensors);
  const glm::dvec2 ahead = glm::clamp(2.0 * here - plan_->centre(sensors_), glm::dvec2(0),
                                      glm::dvec2(plan_->frame.samples - 1));
  std::vector<TileName> coming;
  for (int level = plan_->finest; level < plan_->outermost; ++level) {
    const Rectangle now = plan_->window(level, here);
    const Rectangle then = plan_->window(level, ahead);
    const glm::ivec2 first = Window::first_tile(now), last = Window::last_tile(now);
    for (int y = Window::first_tile(then).y; y <= Window::last_tile(then).y; ++y) {
      for (int x = Window::first_tile(then).x; x <= Window::last_tile(then).x; ++x) {
        if (x < first.x || x > last.x || y < first.y || y > last.y)
          coming.push_back({level, {x, y}});
      }
    }
  }
  plan_->source->prefetch(coming);
  return next;
}

Clipmap::Clipmap(std::shared_ptr<const Plan> plan, const SensorBox& sensors, const Clipmap* before,
                 const PassRunner& runner)
    : plan_(std::move(plan)), sensors_(sensors) {
  const glm::dvec2 centre = plan_->centre(sensors);
  windows_.resize(static_cast<std::size_t>(plan_->outermost) + 1);
  for (int level = plan_->finest; level <= plan_->outermost; ++level) {
    const auto i = static_cast<std::size_t>(level);
    const Rectangle where = plan_->window(level, centre);
    const Window* old = before != nullptr ? before->windows_[i].get() : nullptr;
    windows_[i] = old != nullptr && old->nodes_in == where
                      ? before->windows_[i]
                      : std::make_shared<const Window>(*plan_, level, where, old);
  }
  select_leaves(runner);
}

// Selects the leaves and lists each in the finest window that contains it.
void Clipmap::select_leaves(const PassRunner& runner) {
  const Lattice& lattice = plan_->lattice;
  const int top = lattice.top_level();
  std::vector<NodeWindow> nodes(static_cast<std::size_t>(top) + 1);
  const auto view = [](const NodeLevel& of, glm::ivec2 first) {
    NodeWindow window = whole_window(of);
    window.first = first;
    return window;
  };
  for (int level = plan_->finest; level <= top; ++level) {
    const auto i = static_cast<std::size_t>(level);
    nodes[i] = level <= plan_->outermost ? view(windows_[i]->nodes, windows_[i]->nodes_in.first)
                                         : view(plan_->coarser[i - windows_.size()], {0, 0});
  }
  selection_ = select_nodes(lattice, nodes, plan_->bound(sensors_), runner);
  for (int level = plan_->finest; level <= plan_->outermost; ++level) {
    const Window& window = *windows_[static_cast<std::size_t>(level)];
    levels_.push_back({.frame = plan_->frame,
                       .heights = window.heights,
                       .first = window.first_point() << level,
                       .step = 1 << level,
                       .leaf_cells = Certificate::block_cells,
                       .part_cells = part_cells,
                       .has_quads = level == plan_->finest && plan_->has_quads(),
                       .leaves = list_leaves(selection_, nodes, level, runner)});
  }
}

}  // namespace groundray
