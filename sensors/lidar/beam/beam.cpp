#include "sensors/lidar/beam/beam.h"

#include <algorithm>
#include <array>
#include <bit>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

// A node is a sub-ray of the beam with radius 1 and tangent 1: its position (h, v) at the aperture
// and its tilt (h, v). Nodes come in octets, rotated by successive eighths of a turn: positions by
// 0, 1, 2, ... and tilts by 0, 5, 10, ... eighths. In an octet all means are zero, the two
// directions of the position have equal variances, as have those of the tilt, and all covariances
// are zero.
constexpr int octet = 8;

// Relation between the two directions of a beam.
enum class Layout {
  Cone,         // parallel, or from one point: only positions or only tilts matter
  Rulings,      // both directions widen in step: sub-rays are rulings of hyperboloids
  Independent,  // out of step: positions and tilts fill all four dimensions
};

void check_pair(Violations& broken, const char* field, const glm::dvec2& value, double below,
                const char* rule) {
  broken.unless(value.x >= 0 && value.x < below && value.y >= 0 && value.y < below,
                "{} = ({}, {}) {}", field, value.x, value.y, rule);
}

void check_beam_spec(const BeamSpec& spec) {
  Violations broken("BeamSpec");
  check_pair(broken, "divergence_rad", spec.divergence_rad, std::numbers::pi / 2,
             "must be in [0, pi/2): is it in milliradians or degrees?");
  check_pair(broken, "aperture_m", spec.aperture_m, std::numeric_limits<double>::infinity(),
             "must be finite and not negative");
  const auto power_of_2 = [](int n) { return n > 0 && std::has_single_bit(unsigned(n)); };
  const bool whole = power_of_2(spec.sub_rays) && spec.sub_rays <= LaserBeam::sub_ray_limit &&
                     (spec.sub_rays == 1 || spec.sub_rays >= 2 * octet);
  broken.unless(whole, "sub_rays = {} must be 1, or a power of 2 from {} to {}", spec.sub_rays,
                2 * octet, LaserBeam::sub_ray_limit);
  const int most = spec.most_sub_rays.value_or(spec.sub_rays);
  broken.unless(!whole || most == spec.sub_rays ||
                    (spec.sub_rays > 1 && power_of_2(most) && most > spec.sub_rays &&
                     most <= LaserBeam::sub_ray_limit),
                "most_sub_rays = {} must be sub_rays = {} times a power of 2, at most {} (1 if "
                "sub_rays is 1)",
                most, spec.sub_rays, LaserBeam::sub_ray_limit);
  broken.throw_if_any();
}

glm::dvec2 half(const glm::dvec2& width, const BeamSpec& spec) {
  // The 1/e^2 width of a Gaussian is sqrt(2 / ln 2) = 1.699 times its full width at half maximum.
  const bool at_half = spec.profile == BeamSpec::Profile::Gaussian &&
                       spec.width == BeamSpec::Width::FullWidthHalfMaximum;
  return width * (at_half ? 0.5 * std::sqrt(2 / std::numbers::ln2) : 0.5);
}

Layout layout_of(const glm::dvec2& waist_m, const glm::dvec2& tangent) {
  if (waist_m == glm::dvec2(0) || tangent == glm::dvec2(0)) return Layout::Cone;
  constexpr double tolerance = 1e-4;  // ratios of angles and of their tangents may differ
  const double one = waist_m.x * tangent.y;
  const double other = waist_m.y * tangent.x;
  return std::abs(one - other) <= tolerance * (one + other) ? Layout::Rulings : Layout::Independent;
}

// Returns the fractional part of 1/2 + index * step. The sequence fills [0, 1) evenly if the step
// is badly approximated by fractions.
double kronecker(int index, double step) {
  const double value = 0.5 + index * step;
  return value - std::floor(value);
}

// Steps of such sequences: quadratic irrationals. Of those tried, these sample half planes and
// wires most accurately at every range; docs/theory/lidar_beam.md lists the errors.
constexpr double cone_step = std::numbers::sqrt3 / 2;
constexpr double place_step = std::numbers::sqrt2 / 2;
constexpr double tilt_step = (std::numbers::phi + 5) / 8;
constexpr double shell_step = std::numbers::sqrt3 - 1;

// Returns the shell of each octet's tilt; the position of octet j is in shell j.
std::vector<int> tilt_shells(Layout layout, BeamSpec::Profile profile, int count) {
  std::vector<int> shells(static_cast<std::size_t>(count));
  std::iota(shells.begin(), shells.end(), 0);
  if (layout != Layout::Independent) return shells;
  // The squared radii of position and tilt add up to 1, so the nodes lie on a 3-sphere: every
  // projection of a uniform 3-sphere onto a plane is a uniform disc.
  if (profile == BeamSpec::Profile::TopHat) return {shells.rbegin(), shells.rend()};
  std::vector<int> order = shells;
  std::ranges::sort(order, {}, [](int j) { return kronecker(j, shell_step); });
  for (int rank = 0; const int j : order) shells[static_cast<std::size_t>(j)] = rank++;
  return shells;
}

// Returns the radius of each shell of a uniform disc, at the middle of the shell's energy.
std::vector<double> uniform_radii(int count) {
  std::vector<double> radii;
  for (int j = 0; j < count; ++j) radii.push_back(std::sqrt((j + 0.5) / count));
  return radii;
}

// Returns the root mean square of r over each shell of a Gaussian: r^2 = -ln(1 - u) / 2, where u is
// the fraction of the energy inside r.
std::vector<double> gaussian_radii(int count) {
  const auto integral = [&](int j) {  // integral of -ln v from 0 to v, the energy fraction outside
    const double v = static_cast<double>(count - j) / count;
    return v > 0 ? v - v * math::log(v) : 0;
  };
  std::vector<double> radii;
  for (int j = 0; j < count; ++j) {
    radii.push_back(std::sqrt(0.5 * count * (integral(j) - integral(j + 1))));
  }
  return radii;
}

using Point = glm::dvec4;  // position and tilt of a node

// Appends a node and its rotations by 90, 180 and 270 degrees.
void add_four(std::vector<Point>& points, const glm::dvec2& p, const glm::dvec2& q) {
  points.insert(points.end(), {{p, q}, {-p.y, p.x, -q.y, q.x}, {-p, -q}, {p.y, -p.x, q.y, -q.x}});
}

std::vector<Point> points_of(Layout layout, std::span<const int> tilt_shells,
                             std::span<const double> radii) {
  const auto at = [](double radius, double turns) {
    const double angle_rad = 2 * std::numbers::pi * turns;
    return radius * glm::dvec2(math::cos(angle_rad), math::sin(angle_rad));
  };
  const auto eighth_turn = [](const glm::dvec2& p) {
    return std::numbers::sqrt2 / 2 * glm::dvec2(p.x - p.y, p.x + p.y);
  };
  std::vector<Point> points;
  points.reserve(radii.size() * octet);
  for (int j = 0; j < static_cast<int>(radii.size()); ++j) {
    const int k = tilt_shells[static_cast<std::size_t>(j)];
    const double place_turns = kronecker(j, layout == Layout::Cone ? cone_step : place_step) / 4;
    const double tilt_turns =
        layout == Layout::Independent ? kronecker(k, tilt_step) : place_turns + 0.25;
    const glm::dvec2 place = at(radii[static_cast<std::size_t>(j)], place_turns);
    const glm::dvec2 tilt = at(radii[static_cast<std::size_t>(k)], tilt_turns);
    const double sense = layout == Layout::Cone ? 1 : -1;
    add_four(points, place, tilt);
    add_four(points, eighth_turn(place), sense * eighth_turn(tilt));
  }
  return points;
}

// Orders sub-rays by recursive bisection, so that those with similar directions are adjacent and
// form narrow packets.
void bundle(std::span<const glm::dvec2> ends, std::span<int> order) {
  if (order.size() <= octet) return;
  const auto end_of = [&](int i) { return ends[static_cast<std::size_t>(i)]; };
  glm::dvec2 low = end_of(order[0]), high = low;
  for (const int i : order) {
    low = glm::min(low, end_of(i));
    high = glm::max(high, end_of(i));
  }
  const int axis = high.x - low.x > high.y - low.y ? 0 : 1;
  std::ranges::sort(order, {}, [&](int i) { return std::pair(end_of(i)[axis], i); });
  bundle(ends, order.first(order.size() / 2));
  bundle(ends, order.subspan(order.size() / 2));
}

std::vector<Point> sorted(const std::vector<Point>& points, std::span<const int> order) {
  std::vector<Point> in_order;
  for (const int i : order) in_order.push_back(points[static_cast<std::size_t>(i)]);
  return in_order;
}

// Nearest points so far: squared distance and index, nearest first.
class Nearest {
 public:
  Nearest() { found_.fill({std::numeric_limits<double>::infinity(), -1}); }

  double reach_squared() const { return found_.back().first; }
  void add(double distance_squared, int index) {
    const std::pair candidate(distance_squared, index);
    if (found_.back() < candidate) return;
    const auto place = std::ranges::upper_bound(found_, candidate);
    std::move_backward(place, found_.end() - 1, found_.end());
    *place = candidate;
  }
  std::span<const std::pair<double, int>> found() const { return found_; }

 private:
  std::array<std::pair<double, int>, 6> found_;  // a vertex of a triangle mesh has six neighbours
};

bool pair_precedes(const glm::ivec2& a, const glm::ivec2& b) {
  return std::pair(a.x, a.y) < std::pair(b.x, b.y);
}

// Returns each point paired with its nearest, by a sweep over all points in order of their first
// coordinate.
std::vector<glm::ivec2> nearest_pairs(std::span<const Point> points) {
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&](int i) -> const Point& { return points[static_cast<std::size_t>(i)]; };
  std::ranges::sort(order, {}, [&](int i) { return std::pair(at(i).x, i); });
  std::vector<glm::ivec2> pairs;
  for (auto here = order.begin(); here != order.end(); ++here) {
    Nearest nearest;
    const auto consider = [&](int i) {  // false if no point further on can be nearer
      const Point apart = at(i) - at(*here);
      if (apart.x * apart.x > nearest.reach_squared()) return false;
      nearest.add(glm::dot(apart, apart), i);
      return true;
    };
    for (auto next = here + 1; next != order.end() && consider(*next);) ++next;
    for (auto last = here; last != order.begin() && consider(*(last - 1));) --last;
    for (const auto& [distance, i] : nearest.found()) {
      pairs.emplace_back(std::min(*here, i), std::max(*here, i));
    }
  }
  std::ranges::sort(pairs, pair_precedes);
  const auto repeated = std::ranges::unique(pairs);
  pairs.erase(repeated.begin(), repeated.end());
  return pairs;
}

}  // namespace

LaserBeam::LaserBeam(const BeamSpec& spec)
    : waist_m_(half(spec.aperture_m, spec)),
      tangent_(half(2. * glm::dvec2(math::tan(0.5 * spec.divergence_rad.x),
                                    math::tan(0.5 * spec.divergence_rad.y)),
                    spec)),
      turn_(spec.turn),
      profile_(spec.profile) {
  check_beam_spec(spec);
  const Layout layout = layout_of(waist_m_, tangent_);
  const bool gaussian = spec.profile == BeamSpec::Profile::Gaussian;
  for (int n = spec.sub_rays; n <= spec.most_sub_rays.value_or(spec.sub_rays); n *= 2) {
    Level& level = levels_.emplace_back();
    if (n == 1) {
      level.nodes.resize(1);
      level.sub_rays.resize(1);
      continue;
    }
    const int count = n / octet;
    const auto shells = tilt_shells(layout, spec.profile, count);
    const auto even = uniform_radii(count);
    const auto points = points_of(layout, shells, gaussian ? gaussian_radii(count) : even);
    const bool spreads = tangent_ != glm::dvec2(0);
    std::vector<glm::dvec2> ends;
    for (const Point& p : points) {
      ends.push_back(spreads ? tangent_ * glm::dvec2(p.z, p.w) : waist_m_ * glm::dvec2(p.x, p.y));
    }
    std::vector<int> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    bundle(ends, order);
    for (const Point& p : sorted(points, order)) level.nodes.push_back({{p.x, p.y}, {p.z, p.w}});
    for (std::size_t i = 0; i < level.nodes.size(); ++i) {
      level.sub_rays.push_back(turned(levels() - 1, i, {}));
    }
    // Nearness is judged by the radii of a uniform disc: a Gaussian's outermost shells are far
    // apart.
    level.neighbours = nearest_pairs(sorted(points_of(layout, shells, even), order));
  }
}

// The regression of a sub-ray's slope t c on its position w(0) a + R t c has the coefficient
// R t^2 / w(R)^2.
LaserBeam::Section LaserBeam::section(double range_m) const noexcept {
  Section section{.radius_m = radius_m(range_m), .range_m = range_m};
  for (int i = 0; i < 2; ++i) {
    if (section.radius_m[i] > 0)
      section.slope[i] = range_m * tangent_[i] * tangent_[i] / section.radius_m[i];
  }
  return section;
}

}  // namespace groundray
