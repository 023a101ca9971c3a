#include "reconstruction/dem/fill/fill_error_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>

#include "core/math.h"

namespace groundray {
namespace {

constexpr std::size_t fewest = 30;
constexpr double least_roughness_m = 1e-9, least_m2 = 1e-18;
constexpr double usual_power = 1.5, usual_roughness_power = 2;  // exponents of the variance
constexpr double usual_weight = 10;                             // weight of these, in errors
constexpr double most_power = 6, most_roughness_power = 3;

Eigen::Vector3d model_terms(double distance_cells, double roughness_m) {
  return {1, math::log(std::max(distance_cells, 1e-3)),
          math::log(std::max(roughness_m, least_roughness_m))};
}

// Squared error and the terms that explain it.
struct Sample {
  Eigen::Vector3d terms;
  double square_m2;
};

// Returns twice the negative log-likelihood, plus that of the prior for the usual exponents, whose
// curvature is that of usual_weight errors.
double misfit_of(const std::vector<Sample>& samples, const Eigen::Vector3d& factors,
                 const Eigen::Vector3d& usual) {
  double sum = usual_weight / 2 * (factors - usual).tail<2>().squaredNorm();
  for (const Sample& sample : samples) {
    const double log_variance = sample.terms.dot(factors);
    sum += log_variance + sample.square_m2 * math::exp(-log_variance);
  }
  return sum;
}

// Scales the model so that squared errors equal its variance on average.
void level_model(const std::vector<Sample>& samples, Eigen::Vector3d& factors) {
  double sum = 0;
  for (const Sample& sample : samples)
    sum += sample.square_m2 * math::exp(-sample.terms.dot(factors));
  factors[0] += math::log(std::max(sum / static_cast<double>(samples.size()), 1e-12));
}

// Takes one step of Fisher scoring, shortened until it is an improvement. Returns whether the
// factors changed.
bool improve(const std::vector<Sample>& samples, const Eigen::Vector3d& usual,
             Eigen::Vector3d& factors) {
  Eigen::Matrix3d information = Eigen::Vector3d(0, usual_weight, usual_weight).asDiagonal();
  Eigen::Vector3d slope = information * (usual - factors);
  for (const Sample& sample : samples) {
    const double excess = sample.square_m2 * math::exp(-sample.terms.dot(factors)) - 1;
    information += sample.terms * sample.terms.transpose();
    slope += excess * sample.terms;
  }
  const Eigen::Vector3d step = information.ldlt().solve(slope);
  const double before = misfit_of(samples, factors, usual);
  for (double length = 1; length > 1e-3; length /= 2) {
    const Eigen::Vector3d next = factors + length * step;
    if (misfit_of(samples, next, usual) < before) {
      factors = next;
      return step.norm() * length > 1e-6;
    }
  }
  return false;
}

constexpr double usual_terms = 8;

}  // namespace

double FillErrorModel::sd_m(double distance_cells, double roughness_m) const {
  const Eigen::Vector3d terms = model_terms(distance_cells, roughness_m);
  return math::exp((terms[0] * factors[0] + terms[1] * factors[1] + terms[2] * factors[2]) / 2);
}

std::optional<FillErrorModel> fit_error_model(std::span<const FillError> errors) {
  if (errors.size() < fewest) return std::nullopt;
  std::vector<Sample> samples;
  samples.reserve(errors.size());
  for (const FillError& error : errors) {
    samples.push_back({model_terms(error.distance_cells, error.roughness_m),
                       std::max(double{error.error_m} * error.error_m, least_m2)});
  }
  const Eigen::Vector3d usual(0, usual_power, usual_roughness_power);
  Eigen::Vector3d factors = usual;
  level_model(samples, factors);
  constexpr int most_improvements = 50;
  for (int step = 0; step < most_improvements && improve(samples, usual, factors); ++step) {
  }
  factors[1] = std::clamp(factors[1], 0.0, most_power);
  factors[2] = std::clamp(factors[2], 0.0, most_roughness_power);
  level_model(samples, factors);
  return FillErrorModel{{factors[0], factors[1], factors[2]}};
}

FillCover cover_of(std::span<const FillError> errors, const FillErrorModel& model) {
  if (errors.empty()) return {};
  FillCover cover{0, 0, 0};
  for (const FillError& error : errors) {
    const double sds =
        std::abs(error.error_m) / model.sd_m(error.distance_cells, error.roughness_m);
    cover.within_1sd += sds <= 1 ? 1 : 0;
    cover.within_2sd += sds <= 2 ? 1 : 0;
    cover.rms_sds += sds * sds;
  }
  const auto count = static_cast<double>(errors.size());
  return {cover.within_1sd / count, cover.within_2sd / count, std::sqrt(cover.rms_sds / count)};
}

int roughness_reach(double distance_cells) noexcept {
  constexpr double most = 20;
  return 3 + static_cast<int>(std::ceil(std::min(1.5 * distance_cells, most)));
}

GroundRoughness::GroundRoughness(glm::ivec2 size, std::span<const float> heights_m)
    : size_(size),
      sums_(static_cast<std::size_t>(size.x + 1) * static_cast<std::size_t>(size.y + 1)) {
  const std::ptrdiff_t wide = size.x;
  for (int row = 0; row < size.y; ++row) {
    Sum line;
    for (int column = 0; column < size.x; ++column) {
      const float* z = heights_m.data() + row * wide + column;
      const auto add = [&line](double difference_m) {
        if (std::isnan(difference_m)) return;
        line.squares_m2 += difference_m * difference_m;
        line.count += 1;
      };
      if (column > 0 && column + 1 < size.x) add(double(z[-1]) - 2 * double(z[0]) + double(z[1]));
      if (row > 0 && row + 1 < size.y) add(double(z[-wide]) - 2 * double(z[0]) + double(z[wide]));
      const auto above = static_cast<std::size_t>(row * (wide + 1) + column + 1);
      const Sum& before = sums_[above];
      sums_[above + static_cast<std::size_t>(wide) + 1] = {before.squares_m2 + line.squares_m2,
                                                           before.count + line.count};
    }
  }
}

GroundRoughness::Sum GroundRoughness::sum_in(glm::ivec2 low, glm::ivec2 high) const noexcept {
  const auto at = [this](int column, int row) -> const Sum& {
    return sums_[static_cast<std::size_t>(row) * static_cast<std::size_t>(size_.x + 1) +
                 static_cast<std::size_t>(column)];
  };
  const Sum &a = at(low.x, low.y), &b = at(high.x, low.y), &c = at(low.x, high.y),
            &d = at(high.x, high.y);
  return {d.squares_m2 - b.squares_m2 - c.squares_m2 + a.squares_m2,
          d.count - b.count - c.count + a.count};
}

double GroundRoughness::at_m(glm::ivec2 sample, int cells, double usual_m) const noexcept {
  const Sum sum =
      sum_in(glm::max(sample - cells, glm::ivec2(0)), glm::min(sample + cells + 1, size_));
  const double squares_m2 = std::fmax(sum.squares_m2, 0) + usual_terms * usual_m * usual_m;
  return std::sqrt(squares_m2 / (sum.count + usual_terms));
}

double GroundRoughness::usual_m() const noexcept {
  const Sum sum = sum_in(glm::ivec2(0), size_);
  return sum.count > 0 ? std::sqrt(std::fmax(sum.squares_m2, 0) / sum.count) : 0;
}

}  // namespace groundray
