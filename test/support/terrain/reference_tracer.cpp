#include "test/support/terrain/reference_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "test/support/real.h"

namespace groundray::testing {
namespace {

struct Line {
  Real start, slope;  // coordinate at t = 0, and per metre
  Real at(Real t) const { return start + t * slope; }
};

struct RealTriangle {
  std::array<std::array<Real, 3>, 3> corner;  // column, row, height

  // Height of the triangle's plane at a point, by barycentric coordinates.
  Real height(Real u, Real v) const {
    const auto& [a, b, c] = corner;
    const Real area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    const Real wb = ((u - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (v - a[1])) / area;
    const Real wc = ((b[0] - a[0]) * (v - a[1]) - (u - a[0]) * (b[1] - a[1])) / area;
    return a[2] + wb * (b[2] - a[2]) + wc * (c[2] - a[2]);
  }
};

struct Located {
  int column, row;
  bool far_half;
};

Located locate(const HeightGrid& grid, Real u, Real v) {
  const int column = std::clamp(static_cast<int>(std::floor(u)), 0, grid.columns() - 2);
  const int row = std::clamp(static_cast<int>(std::floor(v)), 0, grid.rows() - 2);
  return {column, row, (u - column) + (v - row) > 1};
}

RealTriangle real_triangle(const HeightGrid& grid, const Located& at) {
  const auto sample = [&](int column, int row) -> std::array<Real, 3> {
    const auto index = static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns()) +
                       static_cast<std::size_t>(column);
    return {Real(column), Real(row), Real(grid.heights_m()[index])};
  };
  const int apex = at.far_half ? 1 : 0;
  return {{sample(at.column + apex, at.row + apex), sample(at.column + 1, at.row),
           sample(at.column, at.row + 1)}};
}

// The values of t after `from` at which the coordinate is an integer, in order.
struct Stops {
  Line line;
  Real next_whole;
  Stops(const Line& along, Real from) : line(along) {
    const Real here = line.at(from);
    next_whole = line.slope > 0 ? std::floor(here) + 1 : std::ceil(here) - 1;
  }
  Real next() const {
    return line.slope == 0 ? std::numeric_limits<Real>::infinity()
                           : (next_whole - line.start) / line.slope;
  }
  void pass() { next_whole += line.slope > 0 ? 1 : -1; }
};

}  // namespace

std::optional<ReferenceHit> trace_reference(const HeightGrid& grid, const Ray& ray) {
  const glm::dvec2 origin = grid.origin_m();
  const glm::dvec2 step = grid.step_m();
  const Line u{(Real(ray.origin.x) - origin.x) / step.x, Real(ray.direction.x) / step.x};
  const Line v{(Real(ray.origin.y) - origin.y) / step.y, Real(ray.direction.y) / step.y};
  const Line z{Real(ray.origin.z), Real(ray.direction.z)};
  const Line w{u.start + v.start, u.slope + v.slope};

  Real begin = 0;
  Real end = ray.far_m;
  const auto within = [&](const Line& line, Real high) {
    if (line.slope == 0) return 0 <= line.start && line.start <= high;
    const Real a = (0 - line.start) / line.slope;
    const Real b = (high - line.start) / line.slope;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
    return begin <= end;
  };
  if (!within(u, grid.columns() - 1) || !within(v, grid.rows() - 1)) return std::nullopt;
  if (std::isinf(end)) end = begin + 1e6L;

  std::array<Stops, 3> stops{Stops(u, begin), Stops(v, begin), Stops(w, begin)};
  for (Real t = begin; t < end;) {
    Stops& first =
        *std::min_element(stops.begin(), stops.end(),
                          [](const Stops& a, const Stops& b) { return a.next() < b.next(); });
    const Real next = std::min(first.next(), end);
    first.pass();
    const Real middle = (t + next) / 2;
    const Located at = locate(grid, u.at(middle), v.at(middle));
    const RealTriangle facet = real_triangle(grid, at);
    const Real above = z.at(t) - facet.height(u.at(t), v.at(t));
    const Real after = z.at(next) - facet.height(u.at(next), v.at(next));
    if (above >= 0 && after < 0) {
      return ReferenceHit{static_cast<double>(t + (next - t) * above / (above - after)), at.column,
                          at.row, at.far_half};
    }
    t = next;
  }
  return std::nullopt;
}

double reference_height_m(const HeightGrid& grid, double x_m, double y_m) {
  const Real u = (Real(x_m) - grid.origin_m().x) / grid.step_m().x;
  const Real v = (Real(y_m) - grid.origin_m().y) / grid.step_m().y;
  if (u < 0 || v < 0 || u > grid.columns() - 1 || v > grid.rows() - 1) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return static_cast<double>(real_triangle(grid, locate(grid, u, v)).height(u, v));
}

}  // namespace groundray::testing
