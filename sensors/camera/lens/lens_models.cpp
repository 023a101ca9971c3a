#include "sensors/camera/lens/lens_models.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "core/math.h"

namespace groundray {
namespace {

void check_scale(const PixelScale& scale, Violations& broken) {
  broken.unless(scale.focal_px.x > 0 && scale.focal_px.y > 0 &&
                    std::isfinite(scale.focal_px.x + scale.focal_px.y),
                "focal lengths of ({}, {}) px must be positive and finite", scale.focal_px.x,
                scale.focal_px.y);
  broken.unless(std::isfinite(scale.centre_px.x + scale.centre_px.y + scale.skew),
                "its centre and skew must be finite");
}

template <typename Numbers>
void check_finite(const Numbers& numbers, Violations& broken) {
  for (std::size_t i = 0; i < std::size(numbers); ++i)
    broken.unless(std::isfinite(numbers[i]), "coefficient {} is {}; it must be finite", i + 1,
                  numbers[i]);
}

void check_f_theta(const FTheta& model, Violations& broken) {
  broken.unless(!model.k.empty() && model.k[0] > 0,
                "its polynomial must increase at 0: the coefficient of the first power is {}",
                model.k.empty() ? 0 : model.k[0]);
  const double area = model.linear.x - model.linear.y * model.linear.z;
  broken.unless(
      std::isfinite(model.centre_px.x + model.centre_px.y) && area > 0 && std::isfinite(area),
      "its centre must be finite and its linear map must preserve orientation: c - d e = {}", area);
}

template <typename Model>
void check_parameters(const Model& model, Violations& broken) {
  if constexpr (requires { model.scale; }) check_scale(model.scale, broken);
  if constexpr (requires { model.k; }) check_finite(model.k, broken);
  if constexpr (std::is_same_v<Model, FTheta>) check_f_theta(model, broken);
  if constexpr (requires { model.alpha; }) {
    broken.unless(0 <= model.alpha && model.alpha <= 1, "alpha = {} must be from 0 to 1",
                  model.alpha);
  }
  if constexpr (requires { model.beta; }) {
    broken.unless(model.beta > 0 && std::isfinite(model.beta), "beta = {} must be positive",
                  model.beta);
  }
  if constexpr (std::is_same_v<Model, DoubleSphere>)
    broken.unless(model.xi > -1 && std::isfinite(model.xi), "xi = {} must be more than -1",
                  model.xi);
  if constexpr (std::is_same_v<Model, Mei>)
    broken.unless(model.xi >= 0 && std::isfinite(model.xi), "xi = {} must be 0 or more", model.xi);
}

// Polynomial, as its coefficients: of the constant, the first power, the second...
using Polynomial = std::vector<double>;

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  Polynomial sum(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) sum[i] += b[i];
  return sum;
}

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

Polynomial derivative(const Polynomial& a) {
  Polynomial slope;
  for (std::size_t i = 1; i < a.size(); ++i) slope.push_back(static_cast<double>(i) * a[i]);
  return slope;
}

double value_of(const Polynomial& a, double x) {
  double sum = 0;
  for (std::size_t i = a.size(); i-- > 0;) sum = sum * x + a[i];
  return sum;
}

// Returns the positive arguments at which the polynomial changes its sign, ascending, to rounding.
std::vector<double> positive_roots(const Polynomial& a) {
  Polynomial trimmed = a;
  while (!trimmed.empty() && trimmed.back() == 0) trimmed.pop_back();
  if (trimmed.size() < 2) return {};
  // The polynomial is monotonic between the roots of its derivative, and has no roots beyond
  // Cauchy's bound.
  double largest = 0;
  for (const double coefficient : trimmed)
    largest = std::max(largest, std::abs(coefficient / trimmed.back()));
  std::vector<double> ends = positive_roots(derivative(trimmed));
  ends.insert(ends.begin(), 0.0);
  ends.push_back(1 + largest);
  std::vector<double> roots;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    double low = ends[i], high = ends[i + 1];
    const bool rises = value_of(trimmed, low) < 0;
    if (rises == (value_of(trimmed, high) < 0)) continue;
    for (double middle = (low + high) / 2; low < middle && middle < high; middle = (low + high) / 2)
      ((value_of(trimmed, middle) < 0) == rises ? low : high) = middle;
    roots.push_back(high);
  }
  return roots;
}

// Returns the radii at which r n(r^2) / d(r^2) has a fold, a root or a pole.
std::vector<double> radial_turns(const Polynomial& n, const Polynomial& d) {
  const Polynomial twice_square{0, 2}, minus_twice_square{0, -2};
  const Polynomial slope =
      n * d + twice_square * (derivative(n) * d) + minus_twice_square * (n * derivative(d));
  std::vector<double> turns;
  for (const Polynomial& part : {slope, n, d}) {
    for (const double square : positive_roots(part)) turns.push_back(std::sqrt(square));
  }
  return turns;
}

std::vector<double> turns(const BrownConrady& model) {
  const auto& k = model.k;
  std::vector<double> found = radial_turns({1, k[0], k[1], k[4]}, {1, k[5], k[6], k[7]});
  for (double& turn : found) turn = math::atan(turn);
  return found;
}
std::vector<double> turns(const KannalaBrandt& model) {
  const auto& k = model.k;
  return radial_turns({1, k[0], k[1], k[2], k[3]}, {1});
}
std::vector<double> turns(const FTheta& model) {
  if (model.direction == FTheta::Polynomial::PixelsToAngle) return {};
  Polynomial forward{0};
  forward.insert(forward.end(), model.k.begin(), model.k.end());
  std::vector<double> found = positive_roots(forward);
  for (const double turn : positive_roots(derivative(forward))) found.push_back(turn);
  return found;
}
std::vector<double> turns(const Mei& model) {
  std::vector<double> found;
  for (const double radius : radial_turns({1, model.k[0], model.k[1]}, {1})) {
    // sin t = radius (cos t + xi)
    const double sine = radius * model.xi / math::hypot(1, radius);
    if (sine <= 1) found.push_back(math::atan(radius) + math::asin(sine));
  }
  return found;
}
template <typename Model>
std::vector<double> turns(const Model& /*model without a polynomial*/) {
  return {};
}

}  // namespace

std::vector<double> turns_rad(const LensModel& model) {
  std::vector<double> found = std::visit([](const auto& kind) { return turns(kind); }, model);
  std::ranges::sort(found);
  return found;
}

void check_lens(const LensModel& model, Violations& broken) {
  std::visit([&](const auto& kind) { check_parameters(kind, broken); }, model);
}

glm::dmat3 sensor_homography(double tau_x_rad, double tau_y_rad) {
  const double cx = math::cos(tau_x_rad), sx = math::sin(tau_x_rad);
  const double cy = math::cos(tau_y_rad), sy = math::sin(tau_y_rad);
  // In glm's order, by columns: the rotation R, then OpenCV's [R33 0 -R13; 0 R33 -R23; 0 0 1].
  const glm::dmat3 turn(cy, 0, sy, sy * sx, cx, -cy * sx, -sy * cx, sx, cy * cx);
  const glm::dmat3 project(cy * cx, 0, 0, 0, cy * cx, 0, sy * cx, -sx, 1);
  return project * turn;
}

double top_of(const std::vector<double>& k) {
  Polynomial rising{0};
  rising.insert(rising.end(), k.begin(), k.end());
  const auto tops = positive_roots(derivative(rising));
  return tops.empty() ? std::numeric_limits<double>::infinity() : tops.front();
}

double FTheta::root(double theta) const {
  double low = 0, high = top;
  if (std::isfinite(top) && theta > top * over(top))
    return std::numeric_limits<double>::quiet_NaN();
  double radius = std::min(theta / k[0], top);
  // Newton's method; bisection, or doubling without an upper end, where a step leaves the bracket.
  for (int i = 0; i < 100; ++i) {
    const double excess = radius * over(radius) - theta;
    (excess > 0 ? high : low) = radius;
    double next = radius - excess / slope(radius);
    if (!(low <= next && next <= high)) next = std::isfinite(high) ? (low + high) / 2 : 2 * radius;
    if (std::abs(next - radius) <= 1e-15 * radius) return next;
    radius = next;
  }
  return radius;
}

}  // namespace groundray
