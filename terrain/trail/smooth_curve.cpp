#include "terrain/trail/smooth_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <iterator>
#include <utility>

namespace groundray {
namespace {

constexpr double least_spacing_m = 0.01;
constexpr double most_length_m = 1e6;
constexpr int pieces_per_segment = 64;  // short enough for the quadrature

}  // namespace

// By Gauss-Legendre quadrature with five nodes.
double SmoothCurve::Cubic::length_m(double t_begin, double t_end) const {
  constexpr std::array<std::pair<double, double>, 5> nodes{
      {{0, 0.5688888888888889},
       {-0.5384693101056831, 0.4786286704993665},
       {0.5384693101056831, 0.4786286704993665},
       {-0.9061798459386640, 0.2369268850561891},
       {0.9061798459386640, 0.2369268850561891}}};
  const double half = (t_end - t_begin) / 2;
  double sum = 0;
  for (const auto& [node, weight] : nodes) {
    sum += weight * glm::length(velocity(t_begin + half * (1 + node)));
  }
  return sum * half;
}

// Returns the centripetal Catmull-Rom segment from p[1] to p[2]: the knots are separated by the
// square roots of the chords.
SmoothCurve::Cubic SmoothCurve::catmull_rom(const std::array<glm::dvec2, 4>& p) {
  const double before = std::sqrt(glm::distance(p[0], p[1]));
  const double across = std::sqrt(glm::distance(p[1], p[2]));
  const double after = std::sqrt(glm::distance(p[2], p[3]));
  const glm::dvec2 chord = p[2] - p[1];
  const glm::dvec2 m1 =
      chord + across * ((p[1] - p[0]) / before - (p[2] - p[0]) / (before + across));
  const glm::dvec2 m2 = chord + across * ((p[3] - p[2]) / after - (p[3] - p[1]) / (across + after));
  return {{p[1], m1, 3.0 * chord - 2.0 * m1 - m2, m1 + m2 - 2.0 * chord}};
}

void SmoothCurve::check(std::span<const glm::dvec2> p, Violations& broken) {
  double length_m = 0;
  for (std::size_t i = 1; i < p.size(); ++i) length_m += glm::distance(p[i - 1], p[i]);
  broken.unless(!(length_m > most_length_m),
                "waypoints_m: the path is {:g} m long, more than the limit of {:g} m", length_m,
                most_length_m);
  broken.unless(p.size() >= 2, "waypoints_m has {} points; a path needs two or more", p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    broken.unless(std::isfinite(p[i].x + p[i].y), "waypoints_m[{}] = ({}, {}) must be finite", i,
                  p[i].x, p[i].y);
    if (i == 0) continue;
    const double chord_m = glm::distance(p[i - 1], p[i]);
    broken.unless(
        !(chord_m < least_spacing_m),
        "waypoints_m[{}] is {} m from the previous one; the distance must be {} m or more: "
        "is it a duplicate?",
        i, chord_m, least_spacing_m);
    if (i + 1 == p.size()) continue;
    const glm::dvec2 in = glm::normalize(p[i] - p[i - 1]);
    const glm::dvec2 out = glm::normalize(p[i + 1] - p[i]);
    broken.unless(!(glm::distance(in, -out) < 1e-3),
                  "the path reverses at waypoints_m[{}] = ({}, {}); add waypoints for the turn", i,
                  p[i].x, p[i].y);
  }
}

SmoothCurve::SmoothCurve(std::span<const glm::dvec2> waypoints_m) {
  const std::size_t n = waypoints_m.size();
  std::vector<glm::dvec2> p{2.0 * waypoints_m[0] - waypoints_m[1]};
  p.insert(p.end(), waypoints_m.begin(), waypoints_m.end());
  p.push_back(2.0 * waypoints_m[n - 1] - waypoints_m[n - 2]);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const Cubic cubic = catmull_rom({p[i], p[i + 1], p[i + 2], p[i + 3]});
    for (int piece = 0; piece < pieces_per_segment; ++piece) {
      const double t = static_cast<double>(piece) / pieces_per_segment;
      pieces_.push_back({cubic, t, length_m_});
      length_m_ += cubic.length_m(t, t + 1.0 / pieces_per_segment);
    }
  }
}

SmoothCurve::Point SmoothCurve::at(double s_m) const noexcept {
  const auto after = std::ranges::upper_bound(pieces_, s_m, {}, &Piece::start_m);
  const Piece& piece = *std::prev(after);
  double t = piece.t;
  for (int step = 0; step < 20; ++step) {  // Newton's method; three or four steps suffice
    const double rest_m = s_m - piece.start_m - piece.cubic.length_m(piece.t, t);
    if (std::abs(rest_m) <= 1e-14 * length_m_) break;
    t = std::clamp(t + rest_m / glm::length(piece.cubic.velocity(t)), piece.t,
                   piece.t + 1.0 / pieces_per_segment);
  }
  return {piece.cubic.at(t), piece.cubic.velocity(t)};
}

}  // namespace groundray
