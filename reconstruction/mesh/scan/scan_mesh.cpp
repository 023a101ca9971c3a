// Linking is by hand: the beams tell which returns are neighbours. It takes 0.11 s of CPU for a
// scan of 64 x 1800 beams, where CGAL's advancing front, which has to find them, takes 13 s.
#include "reconstruction/mesh/scan/scan_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/math.h"
#include "reconstruction/mesh/mesh_arrays.h"

namespace groundray {
namespace {

constexpr double infinite_m = std::numeric_limits<double>::infinity();
constexpr int inside = 3;  // edges from the boundary at which confidence no longer rises

/// Beam with a return; otherwise its range is 0.
struct Beam {
  glm::dvec3 towards{0};  // unit
  double range_m = 0;
};

/// Triangle of cells, and its confidence without the vertices' factor.
struct Face {
  std::array<std::uint32_t, 3> cells{};
  float weight = 0;
};

/// Four cells of two rows and two columns, A B over C D.
using Quad = std::array<std::uint32_t, 4>;
enum Corner { A, B, C, D };

/// Inner edge of a quad: of two faces, or of one from B to C or from A to D.
enum class Diagonal : std::uint8_t { None, Shared, Rising, Falling };

/// Corners of a quad without one, with equal orientation.
constexpr std::array<std::array<Corner, 3>, 4> without{
    {{B, C, D}, {A, C, D}, {A, D, B}, {A, C, B}}};

void check_limits(const ScreeningLimits& limits) {
  Violations broken("ScreeningLimits");
  broken.unless(limits.incidence_rad > 0 && limits.incidence_rad <= std::numbers::pi / 2,
                "incidence_rad = {} must be > 0 and <= pi / 2: is it in degrees?",
                limits.incidence_rad);
  broken.unless(limits.longest_m > 0, "longest_m = {} must be > 0", limits.longest_m);
  broken.unless(limits.noise_sds >= 0 && std::isfinite(limits.noise_sds),
                "noise_sds = {} must be >= 0 and finite", limits.noise_sds);
  broken.throw_if_any();
}

std::vector<Beam> beams_of_scan(const OrganisedScan& scan) {
  std::vector<Beam> beams(scan.points_m.size());
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const glm::dvec3 way_m = scan.points_m[i] - scan.origins_m[i];
    const double range_m = glm::length(way_m);
    if (!(range_m > 0 && range_m < infinite_m)) continue;  // NaN too
    beams[i] = {way_m / range_m, range_m};
  }
  return beams;
}

/// Links one scan. Cells are numbered as in the scan.
class Linker {
 public:
  Linker(const OrganisedScan& scan, const ScreeningLimits& limits)
      : scan_(scan),
        beams_(beams_of_scan(scan)),
        secant_(1 / std::max(math::cos(limits.incidence_rad), 1e-12)),
        tangent_(std::min(math::tan(limits.incidence_rad), 1e12)),
        longest_m_(limits.longest_m),
        noise_sds_(limits.noise_sds),
        uses_right_(beams_.size()),
        uses_down_(beams_.size()),
        diagonals_(beams_.size()) {
    find_sense();
    for_each_quad([this](const Quad& quad) { link_quad(quad); });
  }

  ScanMesh mesh() const;

 private:
  bool has(std::uint32_t cell) const { return beams_[cell].range_m > 0; }
  const glm::dvec3& point(std::uint32_t cell) const { return scan_.points_m[cell]; }

  template <typename F>
  void for_each_quad(const F& use) const {
    if (scan_.rows < 2 || scan_.columns < 2) return;
    const auto columns = static_cast<std::uint32_t>(scan_.columns);
    const std::uint32_t last = scan_.is_round && columns > 2 ? columns : columns - 1;
    for (std::uint32_t row = 0; row + 1 < static_cast<std::uint32_t>(scan_.rows); ++row) {
      const std::uint32_t upper = row * columns, lower = upper + columns;
      for (std::uint32_t column = 0; column < last; ++column) {
        const std::uint32_t next = column + 1 < columns ? column + 1 : 0;
        use(Quad{upper + column, upper + next, lower + column, lower + next});
      }
    }
  }

  glm::dvec3 direction(const std::array<std::uint32_t, 3>& cells) const {
    return glm::normalize(beams_[cells[0]].towards + beams_[cells[1]].towards +
                          beams_[cells[2]].towards);
  }

  /// Returns the normal, twice the area long, towards the side from which the corners run
  /// counter-clockwise.
  glm::dvec3 normal(const std::array<std::uint32_t, 3>& cells) const {
    return glm::cross(point(cells[1]) - point(cells[0]), point(cells[2]) - point(cells[0]));
  }

  /// Determines whether cells (0, 0), (1, 0), (0, 1) face the sensor in most quads.
  void find_sense() {
    std::int64_t towards = 0;
    for_each_quad([&](const Quad& q) {
      if (!has(q[B]) || !has(q[C]) || (!has(q[A]) && !has(q[D]))) return;
      const auto [i, j, k] = has(q[A]) ? without[D] : without[A];
      const std::array<std::uint32_t, 3> cells{q[i], q[j], q[k]};
      towards += glm::dot(normal(cells), direction(cells)) < 0 ? 1 : -1;
    });
    is_turned_ = towards < 0;
  }

  std::array<std::uint32_t, 3> cells_of(const Quad& quad, Corner left_out) const {
    const auto& [i, j, k] = without[left_out];
    if (is_turned_) return {quad[i], quad[k], quad[j]};
    return {quad[i], quad[j], quad[k]};
  }

  bool is_folded(const std::array<std::uint32_t, 3>& cells) const {
    return !(glm::dot(normal(cells), direction(cells)) < 0);
  }

  bool is_edge(std::uint32_t p, std::uint32_t q) const {
    const glm::dvec3 edge_m = point(p) - point(q);
    const double length_m = glm::length(edge_m);
    if (!(length_m <= longest_m_)) return false;
    const Beam& a = beams_[p];
    const Beam& b = beams_[q];
    const double near_m = std::min(a.range_m, b.range_m);
    const glm::dvec3 apart_m =
        scan_.origins_m[p] - scan_.origins_m[q] + near_m * (a.towards - b.towards);
    const glm::dvec3 mean = a.towards + b.towards;
    const double along = glm::dot(apart_m, mean);
    const double across_m = std::sqrt(std::max(
        0.0, glm::dot(apart_m, apart_m) - along * along / std::max(glm::dot(mean, mean), 1e-300)));
    const double sd_m = math::hypot(double{scan_.sd_m[p]}, double{scan_.sd_m[q]});
    return length_m <= across_m * secant_ + noise_sds_ * sd_m;
  }

  /// Returns true if the incidence of a triangle that is not folded exceeds the limit by more than
  /// noise. The component of the normal across the beams over that along them is the tangent of the
  /// incidence; both are linear in each of the ranges.
  bool is_steep(const std::array<std::uint32_t, 3>& cells, const glm::dvec3& normal_m2,
                const glm::dvec3& towards) const {
    const double along_m2 = glm::dot(normal_m2, towards);
    const glm::dvec3 rest_m2 = normal_m2 - along_m2 * towards;
    const double across_m2 = glm::length(rest_m2);
    const double excess_m2 = across_m2 - std::abs(along_m2) * tangent_;
    if (excess_m2 <= 0) return false;
    double variance_m4 = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const glm::dvec3 opposite_m = point(cells[(j + 2) % 3]) - point(cells[(j + 1) % 3]);
      const double part_m2 = glm::dot(glm::cross(towards, opposite_m), rest_m2) / across_m2 *
                             double{scan_.sd_m[cells[j]]};
      variance_m4 += part_m2 * part_m2;
    }
    return excess_m2 > noise_sds_ * std::sqrt(variance_m4);
  }

  void add(const Quad& quad, Corner left_out);
  void link_quad(const Quad& quad);
  void count_edges(const Quad& quad, Corner left_out);
  std::vector<std::uint8_t> depths() const;
  void give_confidence(ScanMesh& made) const;

  const OrganisedScan& scan_;
  std::vector<Beam> beams_;
  double secant_, tangent_, longest_m_, noise_sds_;
  bool is_turned_ = false;
  std::vector<Face> faces_, rejected_;
  // By cell: number of faces with the edge to the next column and with that to the next row, and
  // the inner edge of the quad whose first cell it is.
  std::vector<std::uint8_t> uses_right_, uses_down_;
  std::vector<Diagonal> diagonals_;
};

void Linker::count_edges(const Quad& quad, Corner left_out) {
  if (left_out == C || left_out == D) ++uses_right_[quad[A]];
  if (left_out == A || left_out == B) ++uses_right_[quad[C]];
  if (left_out == B || left_out == D) ++uses_down_[quad[A]];
  if (left_out == A || left_out == C) ++uses_down_[quad[B]];
  Diagonal& diagonal = diagonals_[quad[A]];
  const bool rises = left_out == A || left_out == D;
  diagonal = diagonal != Diagonal::None ? Diagonal::Shared
             : rises                    ? Diagonal::Rising
                                        : Diagonal::Falling;
}

void Linker::add(const Quad& quad, Corner left_out) {
  Face face{cells_of(quad, left_out)};
  const auto& [i, j, k] = face.cells;
  const glm::dvec3 normal_m2 = normal(face.cells);
  const glm::dvec3 towards = direction(face.cells);
  if (!(glm::dot(normal_m2, towards) < 0) || !is_edge(i, j) || !is_edge(j, k) || !is_edge(k, i) ||
      is_steep(face.cells, normal_m2, towards)) {
    rejected_.push_back(face);
    return;
  }
  const glm::dvec3 a = point(j) - point(i), b = point(k) - point(j), c = point(i) - point(k);
  const double longest_m2 = std::max({glm::dot(a, a), glm::dot(b, b), glm::dot(c, c)});
  const double twice_m2 = glm::length(normal_m2);
  face.weight = static_cast<float>(-glm::dot(normal_m2, towards) / twice_m2 *
                                   std::min(1.0, 2 * twice_m2 / longest_m2));
  faces_.push_back(face);
  count_edges(quad, left_out);
}

void Linker::link_quad(const Quad& quad) {
  const int there = int{has(quad[A])} + has(quad[B]) + has(quad[C]) + has(quad[D]);
  if (there < 3) return;
  if (there == 3) {
    for (const Corner left_out : {A, B, C, D}) {
      if (!has(quad[left_out])) return add(quad, left_out);
    }
  }
  const glm::dvec3 falling_m = point(quad[A]) - point(quad[D]);
  const glm::dvec3 rising_m = point(quad[B]) - point(quad[C]);
  const std::array<std::array<Corner, 2>, 2> cuts{{{B, C}, {A, D}}};  // corners to leave out
  std::size_t cut = glm::dot(falling_m, falling_m) < glm::dot(rising_m, rising_m) ? 0 : 1;
  const auto folds = [&](const std::array<Corner, 2>& corners) {
    return is_folded(cells_of(quad, corners[0])) || is_folded(cells_of(quad, corners[1]));
  };
  if (folds(cuts[cut]) && !folds(cuts[1 - cut])) cut = 1 - cut;
  add(quad, cuts[cut][0]);
  add(quad, cuts[cut][1]);
}

/// Returns the number of edges between each cell and the boundary, at most `inside`.
std::vector<std::uint8_t> Linker::depths() const {
  std::vector<std::uint8_t> depth(beams_.size(), inside);
  const auto mark = [&](bool is_border, std::uint32_t p, std::uint32_t q) {
    if (is_border) depth[p] = depth[q] = 0;
  };
  for_each_quad([&](const Quad& quad) {
    mark(uses_right_[quad[A]] == 1, quad[A], quad[B]);
    mark(uses_right_[quad[C]] == 1, quad[C], quad[D]);
    mark(uses_down_[quad[A]] == 1, quad[A], quad[C]);
    mark(uses_down_[quad[B]] == 1, quad[B], quad[D]);
    mark(diagonals_[quad[A]] == Diagonal::Rising, quad[B], quad[C]);
    mark(diagonals_[quad[A]] == Diagonal::Falling, quad[A], quad[D]);
  });
  for (std::uint8_t found = 0; found + 1 < inside; ++found) {
    for (const Face& face : faces_) {
      const auto& [i, j, k] = face.cells;
      if (std::min({depth[i], depth[j], depth[k]}) != found) continue;
      for (const std::uint32_t cell : face.cells)
        depth[cell] = std::min<std::uint8_t>(depth[cell], static_cast<std::uint8_t>(found + 1));
    }
  }
  return depth;
}

/// Numbers the cells that faces use, in order, and returns the faces' triangles in `triangles`.
/// @return the cells.
std::vector<std::uint32_t> number_cells(const std::vector<Face>& faces, std::size_t cells,
                                        std::vector<glm::uvec3>& triangles) {
  std::vector<std::uint32_t> number(cells, 0);
  for (const Face& face : faces) {
    for (const std::uint32_t cell : face.cells) number[cell] = 1;
  }
  std::vector<std::uint32_t> used;
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    if (number[cell] == 0) continue;
    number[cell] = static_cast<std::uint32_t>(used.size());
    used.push_back(cell);
  }
  triangles.reserve(faces.size());
  for (const Face& face : faces) {
    const auto& [i, j, k] = face.cells;
    triangles.emplace_back(number[i], number[j], number[k]);
  }
  return used;
}

void Linker::give_confidence(ScanMesh& made) const {
  const std::vector<std::uint8_t> depth = depths();
  std::vector<float> sum(made.cells.size()), worth(made.cells.size());
  std::vector<std::uint32_t> count(made.cells.size());
  for (std::size_t i = 0; i < worth.size(); ++i)
    worth[i] = static_cast<float>(1 + depth[made.cells[i]]) / (1 + inside);
  made.face_confidence.reserve(faces_.size());
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const glm::uvec3& t = made.mesh.shape.triangles[f];
    made.face_confidence.push_back(faces_[f].weight * (worth[t.x] + worth[t.y] + worth[t.z]) / 3);
    for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
      sum[vertex] += faces_[f].weight;
      ++count[vertex];
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i)
    made.mesh.confidence.push_back(sum[i] / static_cast<float>(count[i]) * worth[i]);
}

ScanMesh Linker::mesh() const {
  ScanMesh made;
  made.cells = number_cells(faces_, beams_.size(), made.mesh.shape.triangles);
  made.mesh.shape.vertices_m = picked(scan_.points_m, made.cells);
  made.mesh.sd_m = picked(scan_.sd_m, made.cells);
  made.mesh.labels = picked(scan_.labels, made.cells);
  made.origins_m = picked(scan_.origins_m, made.cells);
  give_confidence(made);
  OcclusionFaces& hidden = made.occlusion;
  const auto cells = number_cells(rejected_, beams_.size(), hidden.shape.triangles);
  hidden.shape.vertices_m = picked(scan_.points_m, cells);
  hidden.origins_m = picked(scan_.origins_m, cells);
  return made;
}

}  // namespace

ScreeningLimits ScreeningLimits::ground() noexcept {
  return {.incidence_rad = 88 * std::numbers::pi / 180, .longest_m = 3};
}

ScreeningLimits ScreeningLimits::strict() noexcept {
  return {.incidence_rad = 85 * std::numbers::pi / 180, .longest_m = 2};
}

ScreeningLimits ScreeningLimits::object() noexcept {
  return {.incidence_rad = math::acos(1.0 / 4), .longest_m = infinite_m};
}

ScanMesh link(const OrganisedScan& scan, const ScreeningLimits& limits) {
  check_limits(limits);
  check_scan(scan, "the scan to link");
  return Linker(scan, limits).mesh();
}

}  // namespace groundray
