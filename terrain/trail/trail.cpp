#include "terrain/trail/trail.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "terrain/trail/line_noise.h"
#include "terrain/trail/route.h"
#include "terrain/trail/smooth_curve.h"

namespace groundray {
namespace {

constexpr double point_spacing_m = 0.5;
constexpr double variation_m = 6;  // distance of the knots of the ruts' variation

using Side = TrailSpec::Ditches::Side;

constexpr double most_size_m = 100;  // of anything across a trail
constexpr double most_per_100_m = 1e4;
constexpr double most_reach_m = 200;

void check_details(const TrailSpec& spec, double cell_m, Violations& broken) {
  const auto check_width = [&](double width_m, std::string_view what) {
    broken.unless(2 * cell_m <= width_m && width_m <= most_size_m,
                  "{} = {} must be at least two cells of the relief, {}, and at most {}: make it "
                  "larger, or relief.cell_m smaller",
                  what, width_m, 2 * cell_m, most_size_m);
  };
  const auto check_height = [&](double height_m, std::string_view what) {
    broken.unless(0 <= height_m && height_m <= most_size_m, "{} = {} must be from 0 to {}", what,
                  height_m, most_size_m);
  };
  const auto check_number = [&](double per_100_m, std::string_view what) {
    broken.unless(0 <= per_100_m && per_100_m <= most_per_100_m, "{} = {} must be from 0 to {:g}",
                  what, per_100_m, most_per_100_m);
  };
  if (const auto& ruts = spec.ruts) {
    check_width(ruts->width_m, "ruts.width_m");
    check_height(ruts->depth_m, "ruts.depth_m");
    check_height(ruts->berm_m, "ruts.berm_m");
    broken.unless(ruts->track_m >= 2 * ruts->width_m,
                  "ruts.track_m = {} must be at least twice their width, {}", ruts->track_m,
                  2 * ruts->width_m);
    broken.unless(ruts->track_m + 2 * ruts->width_m <= spec.width_m,
                  "ruts: with their berms they are {} m wide, more than the trail's width_m = {}",
                  ruts->track_m + 2 * ruts->width_m, spec.width_m);
  }
  if (const auto& washboard = spec.washboard) {
    check_width(washboard->wavelength_m / 2, "half of washboard.wavelength_m");
    check_height(washboard->amplitude_m, "washboard.amplitude_m");
  }
  if (const auto& potholes = spec.potholes) {
    const auto [least_m, most_m] = std::pair(potholes->diameter_m.x, potholes->diameter_m.y);
    check_width(least_m, "potholes.diameter_m[0]");
    check_height(potholes->depth_m, "potholes.depth_m");
    check_number(potholes->per_100_m, "potholes.per_100_m");
    broken.unless(least_m <= most_m && most_m <= spec.width_m,
                  "potholes.diameter_m = [{}, {}] must increase, up to width_m = {} at most",
                  least_m, most_m, spec.width_m);
  }
  if (const auto& ditches = spec.ditches) {
    check_width(ditches->width_m, "ditches.width_m");
    check_height(ditches->depth_m, "ditches.depth_m");
  }
  if (const auto& benches = spec.benches) {
    check_width(benches->width_m, "benches.width_m");
    broken.unless(
        cell_m <= benches->height_m && benches->height_m <= most_size_m,
        "benches.height_m = {} must be at least a cell of the relief, {}, and at most {}: "
        "make it larger, or relief.cell_m smaller",
        benches->height_m, cell_m, most_size_m);
    broken.unless(0 <= benches->roughness_m && benches->roughness_m <= benches->width_m,
                  "benches.roughness_m = {} must be from 0 to their width_m, {}",
                  benches->roughness_m, benches->width_m);
    if (const auto& blocks = benches->blocks) {
      check_width(blocks->length_m, "benches.blocks.length_m");
      broken.unless(cell_m <= blocks->height_m && blocks->height_m <= benches->height_m,
                    "benches.blocks.height_m = {} must be from a cell of the relief, {}, to "
                    "benches.height_m, {}",
                    blocks->height_m, cell_m, benches->height_m);
    }
  }
  if (const auto& roots = spec.roots) {
    check_width(roots->width_m, "roots.width_m");
    check_height(roots->height_m, "roots.height_m");
    check_number(roots->per_100_m, "roots.per_100_m");
  }
}

BankProfile bank_of(const TrailSpec& spec) { return {spec.bank_slope, spec.benches, spec.variant}; }

// Returns a valid specification, with waypoints.
TrailSpec checked(const TrailSpec& spec, const Trail::GroundHeight& ground, glm::dvec2 origin_w_m,
                  double cell_m) {
  Violations broken("trail '" + spec.name + "'");
  if (!spec.between_m) SmoothCurve::check(spec.waypoints_m, broken);
  const auto in = [&](double value, double low, double high, std::string_view what) {
    broken.unless(low <= value && value <= high, "{} = {} must be from {} to {}", what, value, low,
                  high);
  };
  broken.unless(2 * cell_m <= spec.width_m && spec.width_m <= most_size_m,
                "width_m = {} must be at least two cells of the relief, {}, and at most {}",
                spec.width_m, 2 * cell_m, most_size_m);
  in(spec.raised_m, -100, 100, "raised_m");
  in(spec.level_over_m, 0, 1e4, "level_over_m");
  in(spec.bank_slope, 0.01, 100, "bank_slope");
  in(spec.most_bank_m, 0, 100, "most_bank_m");
  in(spec.most_grade, 0, 10, "most_grade");
  const double run_m = bank_of(spec).run_m(spec.most_bank_m);
  broken.unless(!(run_m > most_reach_m),
                "most_bank_m = {}: such banks reach {:g} m, more than the limit of {} m: make it "
                "smaller, or bank_deg larger{}",
                spec.most_bank_m, run_m, most_reach_m,
                spec.benches ? ", or benches higher or narrower" : "");
  in(spec.crown_m, 0, 10, "crown_m");
  in(spec.relief_share, 0, 1, "relief_share");
  in(spec.variation, 0, 1, "variation");
  check_details(spec, cell_m, broken);
  if (const auto& ends = spec.between_m)
    broken.unless(glm::distance((*ends)[0], (*ends)[1]) >= 4,
                  "between_m: its ends must be at least 4 m apart");
  broken.throw_if_any();
  const auto check_ground = [&](glm::dvec2 p_W) {
    broken.unless(ground(p_W - origin_w_m).has_value(),
                  "({:.1f}, {:.1f}) m in W is outside the DEM or in a hole: move it", p_W.x, p_W.y);
  };
  TrailSpec complete = spec;
  if (!spec.between_m) {
    for (const glm::dvec2 p_W : spec.waypoints_m) check_ground(p_W);
    broken.throw_if_any();
    return complete;
  }
  const auto [from_W, to_W] = *spec.between_m;
  check_ground(from_W);
  check_ground(to_W);
  broken.throw_if_any();
  const RouteLimits limits{.most_grade = spec.most_grade,
                           .most_side_slope = spec.most_bank_m / (spec.width_m / 2)};
  try {
    complete.waypoints_m =
        find_route(ground, from_W - origin_w_m, to_W - origin_w_m, limits, origin_w_m);
  } catch (const Error& fault) {
    throw Error("trail '{}': {}", spec.name, fault.what());
  }
  for (glm::dvec2& p : complete.waypoints_m) p += origin_w_m;
  return complete;
}

TangentLine line_of(const TrailSpec& spec, glm::dvec2 origin_w_m) {
  std::vector<glm::dvec2> waypoints_D;
  for (const glm::dvec2& p_W : spec.waypoints_m) waypoints_D.push_back(p_W - origin_w_m);
  const SmoothCurve curve(waypoints_D);
  const double count = std::ceil(curve.length_m() / point_spacing_m * (1 - 1e-9));
  TangentLine line{.points_m = {}, .tangents = {}, .spacing_m = curve.length_m() / count};
  for (double i = 0; i <= count; ++i) {
    const auto [p_m, along] = curve.at(i * line.spacing_m);
    line.points_m.push_back(p_m);
    line.tangents.push_back(glm::normalize(along));
  }
  return line;
}

double reach_m(const TrailSpec& spec) {
  const double ditch_m = spec.ditches ? spec.ditches->width_m : 0;
  return spec.width_m / 2 +
         std::max(ditch_m + bank_of(spec).run_m(spec.most_bank_m), spec.width_m / 2);
}

// Ridge of height 1 and width 1 about 0, without edges.
double ridge(double x) noexcept {
  const double inside = std::max(0.0, 1 - 4 * x * x);
  return inside * inside;
}

double smooth_step(double x) noexcept {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

glm::dvec2 left_of(glm::dvec2 along) { return {-along.y, along.x}; }

// Random numbers of a trail's details, in the order in which they are made.
class DetailRandom {
 public:
  DetailRandom(Seed variant, std::uint32_t purpose)
      : key_{.seed = variant, .sensor = purpose, .stream = RandomStream::Relief} {}

  double between(double low, double high) {
    ++key_.pulse;
    return low + (high - low) * random_uniform(key_).x;
  }

 private:
  RandomKey key_;
};

enum Purpose : std::uint32_t { DepthVariation = 1000, ShiftVariation, Potholes, Roots };

// Returns a smooth random function at the points of a line, from -1 to 1.
std::vector<double> smooth_noise(const TangentLine& line, Seed variant, Purpose purpose) {
  const RandomKey key{.seed = variant, .sensor = purpose, .stream = RandomStream::Relief};
  std::vector<double> values;
  for (std::size_t i = 0; i < line.points_m.size(); ++i)
    values.push_back(line_noise(key, line.spacing_m * static_cast<double>(i) / variation_m));
  return values;
}

}  // namespace

Trail::Trail(const TrailSpec& spec, const GroundHeight& ground, glm::dvec2 origin_w_m,
             double cell_m)
    : spec_(checked(spec, ground, origin_w_m, cell_m)),
      bank_(bank_of(spec_)),
      field_(line_of(spec_, origin_w_m), reach_m(spec_)) {
  level(ground, origin_w_m);
  vary();
  place_details();
}

// Averages the ground's heights along the line, and checks grades and banks.
void Trail::level(const GroundHeight& ground, glm::dvec2 origin_w_m) {
  const TangentLine& line = field_.line();
  const auto fail = [&](std::size_t i, std::string_view text) {
    const glm::dvec2 p_W = line.points_m[i] + origin_w_m;
    throw Error("trail '{}': {} at ({:.1f}, {:.1f}) m in W, {:.1f} m along it; {}", spec_.name,
                text, p_W.x, p_W.y, line.spacing_m * static_cast<double>(i),
                "move the waypoints or change the limit");
  };
  std::vector<double> ground_m;
  for (std::size_t i = 0; i < line.points_m.size(); ++i) {
    const auto height_m = ground(line.points_m[i]);
    if (!height_m) fail(i, "it leaves the DEM, or crosses a hole,");
    ground_m.push_back(*height_m);
  }
  const std::size_t last = ground_m.size() - 1;
  const auto most = static_cast<std::size_t>(std::round(spec_.level_over_m / 2 / line.spacing_m));
  for (std::size_t i = 0; i <= last; ++i) {
    const std::size_t half = std::min({most, i, last - i});  // symmetric: keeps even grades
    double sum_m = ground_m[i], weights = 1;
    for (std::size_t k = 1; k <= half; ++k) {
      const double weight = ridge(0.5 * static_cast<double>(k) / (static_cast<double>(half) + 1));
      sum_m += weight * (ground_m[i - k] + ground_m[i + k]);
      weights += 2 * weight;
    }
    levels_m_.push_back(sum_m / weights + spec_.raised_m);
  }
  for (std::size_t i = 0; i <= last; ++i) {
    const double grade = i == 0 ? 0 : (levels_m_[i] - levels_m_[i - 1]) / line.spacing_m;
    if (std::abs(grade) > spec_.most_grade) {
      fail(i, fmt::format("its grade of {:.1f} degrees exceeds most_grade_deg = {:.1f}",
                          math::atan(std::abs(grade)) * 180 / std::numbers::pi,
                          math::atan(spec_.most_grade) * 180 / std::numbers::pi));
    }
    for (const double side : {-1.0, 0.0, 1.0}) {
      // Where a bank of the largest height ends, it must have met the ground.
      for (const double beyond_m : {0.0, bank_.run_m(spec_.most_bank_m)}) {
        const double out_m = side * (edge_m(side) + beyond_m);
        const glm::dvec2 p = line.points_m[i] + out_m * left_of(line.tangents[i]);
        const double bank_m = ground(p).value_or(levels_m_[i]) - levels_m_[i];
        if (std::abs(bank_m) <= spec_.most_bank_m) continue;
        fail(i, fmt::format("it needs {} of {:.2f} m, more than most_bank_m = {:.2f}",
                            bank_m > 0 ? "a cutting" : "an embankment", std::abs(bank_m),
                            spec_.most_bank_m));
      }
    }
  }
}

void Trail::vary() {
  if (!spec_.ruts) return;
  depths_ = smooth_noise(field_.line(), spec_.variant, DepthVariation);
  shifts_m_ = smooth_noise(field_.line(), spec_.variant, ShiftVariation);
  for (double& depth : depths_) depth = 1 + spec_.variation * depth;
  for (double& shift_m : shifts_m_) shift_m *= spec_.variation * spec_.ruts->width_m / 2;
}

void Trail::place_details() {
  const double length_m = field_.line().length_m(), half_m = spec_.width_m / 2;
  const auto count = [&](DetailRandom& random, double per_100_m) {
    return static_cast<std::size_t>(per_100_m * length_m / 100 + random.between(0, 1));
  };
  if (const auto& spec = spec_.potholes) {
    DetailRandom random(spec_.variant, Potholes);
    potholes_.resize(count(random, spec->per_100_m));
    for (Pothole& hole : potholes_) {
      hole.radius_m = random.between(spec->diameter_m.x, spec->diameter_m.y) / 2;
      hole.depth_m = spec->depth_m * 2 * hole.radius_m / spec->diameter_m.y;
      const double room_m = half_m - hole.radius_m;
      hole.at = {random.between(0, length_m), random.between(-room_m, room_m)};
    }
  }
  if (const auto& spec = spec_.roots) {
    DetailRandom random(spec_.variant, Roots);
    roots_.resize(count(random, spec->per_100_m));
    for (Root& root : roots_) {
      root.at = {random.between(0, length_m), random.between(-half_m, half_m)};
      const double turn_rad = random.between(-0.9, 0.9);  // from straight across
      root.along = {math::sin(turn_rad), math::cos(turn_rad)};
      root.half_length_m = random.between(0.3, 1) * half_m;
    }
  }
  const auto along_m = [](const auto& detail) { return detail.at.along_m; };
  std::ranges::stable_sort(potholes_, {}, along_m);
  std::ranges::stable_sort(roots_, {}, along_m);
}

// Returns a quantity of the line's points between them.
double Trail::along(const std::vector<double>& values, double along_m) const noexcept {
  const double at = along_m / field_.line().spacing_m;
  const auto i = std::min(static_cast<std::size_t>(at), values.size() - 2);
  return std::lerp(values[i], values[i + 1], at - static_cast<double>(i));
}

// Returns the distance of the banks from the line on a side.
double Trail::edge_m(double across_m) const noexcept {
  const bool has_ditch = spec_.ditches && (spec_.ditches->side == Side::Both ||
                                           (spec_.ditches->side == Side::Left) == (across_m > 0));
  return spec_.width_m / 2 + (has_ditch ? spec_.ditches->width_m : 0);
}

double Trail::rut_m(const LinePlace& at) const noexcept {
  const auto& [track_m, width_m, depth_m, berm_m] = *spec_.ruts;
  const double across_m = at.across_m - along(shifts_m_, at.along_m);
  const double off_m = std::abs(across_m) - track_m / 2;  // from the centre of the nearer one
  const double berm = ridge(2 * (std::abs(off_m) - 0.75 * width_m) / width_m);
  return along(depths_, at.along_m) * (berm_m * berm - depth_m * ridge(off_m / width_m));
}

// Returns the height of everything on the trail, above its level at the sides.
double Trail::detail_m(const LinePlace& at) const noexcept {
  const double half_m = spec_.width_m / 2, out_m = std::abs(at.across_m);
  double sum_m = 0;
  if (out_m > half_m) {
    const auto& [width_m, depth_m, side] = *spec_.ditches;
    return -depth_m * ridge((out_m - half_m - width_m / 2) / width_m);
  }
  const double share = out_m / half_m;
  sum_m += spec_.crown_m * (1 - share * share);
  if (spec_.ruts) sum_m += rut_m(at);
  if (const auto& washboard = spec_.washboard) {
    const double phase = 2 * std::numbers::pi * at.along_m / washboard->wavelength_m;
    sum_m += washboard->amplitude_m * math::sin(phase) * (1 - share * share * share * share);
  }
  const auto each_near = [&](const auto& details, double reach_m, const auto& act) {
    const auto first = std::ranges::lower_bound(details, at.along_m - reach_m, {},
                                                [](const auto& d) { return d.at.along_m; });
    for (auto it = first; it != details.end() && it->at.along_m <= at.along_m + reach_m; ++it)
      act(*it, glm::dvec2(at.along_m - it->at.along_m, at.across_m - it->at.across_m));
  };
  if (spec_.potholes) {
    each_near(potholes_, spec_.potholes->diameter_m.y / 2,
              [&](const Pothole& hole, glm::dvec2 off_m) {
                sum_m -= hole.depth_m * ridge(glm::length(off_m) / (2 * hole.radius_m));
              });
  }
  if (spec_.roots) {
    each_near(roots_, half_m + spec_.roots->width_m, [&](const Root& root, glm::dvec2 off_m) {
      const double length_m = glm::dot(off_m, root.along);
      const double beside_m = glm::dot(off_m, left_of(root.along));
      sum_m += spec_.roots->height_m * ridge(beside_m / spec_.roots->width_m) *
               ridge(length_m / (2 * root.half_length_m));
    });
  }
  return sum_m;
}

void Trail::apply(glm::dvec2 p, Shape& ground) const noexcept {
  const auto at = field_.place(p);
  if (!at || std::isnan(ground.height_m)) return;
  const double half_m = spec_.width_m / 2, out_m = std::abs(at->across_m);
  const double beyond_m = out_m - edge_m(at->across_m);
  const double level_m = along(levels_m_, at->along_m);
  const double to_end_m = std::min(at->along_m, field_.line().length_m() - at->along_m);
  if (beyond_m > 0) {
    const double rise_m = bank_.rise_m(beyond_m, *at, to_end_m);
    ground.height_m = std::clamp(ground.height_m, level_m - rise_m, level_m + rise_m);
  } else {  // details fade towards the ends
    ground.height_m = level_m + smooth_step(to_end_m / spec_.width_m) * detail_m(*at);
  }
  ground.relief_share *= std::lerp(spec_.relief_share, 1.0, smooth_step((out_m - half_m) / half_m));
}

}  // namespace groundray
