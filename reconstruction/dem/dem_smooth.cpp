#include "reconstruction/dem/dem_smooth.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/error.h"

namespace groundray {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

constexpr std::size_t bytes_per_sample = 800;
constexpr double still_sds = 1e-3;  // of a height: a move that ends the rounds

void check(const GridFrame& frame, std::span<const float> heights_m,
           std::span<const float> variance_m2, const SmoothOptions& options, const Work& work) {
  Violations broken("smoothing a DEM");
  const auto samples = std::int64_t{frame.samples.x} * frame.samples.y;
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2 &&
                    samples < std::numeric_limits<std::int32_t>::max(),
                "samples = [{}, {}] must be 2 or more each way, and 2^31 at most in all",
                frame.samples.x, frame.samples.y);
  const double area_m2 = frame.step_m.x * frame.step_m.y;
  broken.unless(std::isfinite(area_m2) && area_m2 != 0,
                "step_m = [{}, {}] must be finite and not zero", frame.step_m.x, frame.step_m.y);
  broken.unless(std::ssize(heights_m) == samples, "heights_m has {} entries for {} samples",
                heights_m.size(), samples);
  broken.unless(std::ssize(variance_m2) == samples, "variance_m2 has {} entries for {} samples",
                variance_m2.size(), samples);
  const double k = options.curvature_sd_per_m.value_or(1);
  broken.unless(k > 0 && std::isfinite(k), "curvature_sd_per_m = {} must be above 0, and finite",
                k);
  const auto is_infinite = [](float z) { return std::isinf(z); };
  broken.unless(std::ranges::none_of(heights_m, is_infinite),
                "a height is infinite; it must be finite, or NaN for none");
  broken.unless(
      std::ranges::none_of(variance_m2, [](float v) { return v <= 0 || std::isinf(v); }),
      "a variance is 0, negative or infinite; it must be above 0, or NaN where nothing was "
      "measured");
  broken.throw_if_any();
  const std::size_t bytes = heights_m.size() * bytes_per_sample;
  if (bytes > work.most_bytes)
    throw Error(
        "smoothing a DEM of {} x {} samples takes {} MB, more than the {} MB allowed; "
        "smooth parts of it that overlap by some 20 cells",
        frame.samples.x, frame.samples.y, bytes / 1'000'000, work.most_bytes / 1'000'000);
}

// The equations of one raster.
class Smoothing {
 public:
  Smoothing(const GridFrame& frame, std::span<const float> heights_m,
            std::span<const float> variance_m2);

  double usual_curvature() const;
  SmoothHeights run(double curvature_sd_per_m, std::size_t most_rounds, const Work& work);

 private:
  void find_rows();
  void add_row(std::span<const std::array<int, 2>> offsets, std::span<const double> factors,
               int column, int row);
  Eigen::VectorXd solve(const Eigen::VectorXd& row_weights, const Eigen::VectorXd& guess) const;

  const GridFrame& frame_;
  std::vector<std::int32_t> numbers_;   // of each sample; -1 for none
  std::vector<std::uint32_t> samples_;  // of each unknown
  double base_m_ = 0;
  Eigen::VectorXd measured_m_, weights_;  // above the base; 1 / variance
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<double> noise_;  // variance of each second derivative, of errors of heights
  Matrix derivatives_;         // by second derivative and unknown; mixed ones times sqrt(2)
};

Smoothing::Smoothing(const GridFrame& frame, std::span<const float> heights_m,
                     std::span<const float> variance_m2)
    : frame_(frame), numbers_(heights_m.size(), -1) {
  for (std::uint32_t i = 0; i < heights_m.size(); ++i) {
    if (std::isnan(heights_m[i]) || std::isnan(variance_m2[i])) continue;
    numbers_[i] = static_cast<std::int32_t>(samples_.size());
    samples_.push_back(i);
  }
  const auto count = static_cast<Eigen::Index>(samples_.size());
  measured_m_.resize(count);
  weights_.resize(count);
  if (count > 0) base_m_ = heights_m[samples_.front()];
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::uint32_t sample = samples_[static_cast<std::size_t>(i)];
    measured_m_[i] = heights_m[sample] - base_m_;
    weights_[i] = 1 / double{variance_m2[sample]};
  }
  find_rows();
}

void Smoothing::add_row(std::span<const std::array<int, 2>> offsets,
                        std::span<const double> factors, int column, int row) {
  std::array<std::int32_t, 4> unknowns{};
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    const int c = column + offsets[k][0], r = row + offsets[k][1];
    if (c >= frame_.samples.x || r >= frame_.samples.y) return;
    unknowns[k] =
        numbers_[static_cast<std::size_t>(r) * static_cast<std::size_t>(frame_.samples.x) +
                 static_cast<std::size_t>(c)];
    if (unknowns[k] < 0) return;
  }
  const auto number = static_cast<int>(noise_.size());
  double noise = 0;
  for (std::size_t k = 0; k < offsets.size(); ++k) {
    entries_.emplace_back(number, unknowns[k], factors[k]);
    noise += factors[k] * factors[k] / weights_[unknowns[k]];
  }
  noise_.push_back(noise);
}

void Smoothing::find_rows() {
  const double dx = std::abs(frame_.step_m.x), dy = std::abs(frame_.step_m.y);
  const double xx = 1 / (dx * dx), yy = 1 / (dy * dy), xy = std::sqrt(2.0) / (dx * dy);
  constexpr std::array<std::array<int, 2>, 3> across{{{0, 0}, {1, 0}, {2, 0}}};
  constexpr std::array<std::array<int, 2>, 3> down{{{0, 0}, {0, 1}, {0, 2}}};
  constexpr std::array<std::array<int, 2>, 4> block{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  for (int row = 0; row < frame_.samples.y; ++row) {
    for (int column = 0; column < frame_.samples.x; ++column) {
      add_row(across, std::array{xx, -2 * xx, xx}, column, row);
      add_row(down, std::array{yy, -2 * yy, yy}, column, row);
      add_row(block, std::array{xy, -xy, -xy, xy}, column, row);
    }
  }
  derivatives_.resize(static_cast<Eigen::Index>(noise_.size()), measured_m_.size());
  derivatives_.setFromTriplets(entries_.begin(), entries_.end());
  entries_ = {};
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The sd of second derivatives beyond what noise makes of it; at least a tenth of that.
double Smoothing::usual_curvature() const {
  if (noise_.empty()) return 1;
  const Eigen::VectorXd rows = derivatives_ * measured_m_;
  std::vector<double> squares;
  for (Eigen::Index i = 0; i < rows.size(); ++i) squares.push_back(rows[i] * rows[i]);
  constexpr double median_of_chi2 = 0.4549;  // with one degree of freedom
  const double noise = median_of(noise_);
  return std::sqrt(std::max(median_of(squares) / median_of_chi2 - noise, noise / 100));
}

Eigen::VectorXd Smoothing::solve(const Eigen::VectorXd& row_weights,
                                 const Eigen::VectorXd& guess) const {
  Matrix matrix = derivatives_.transpose() * (row_weights.asDiagonal() * derivatives_);
  for (Eigen::Index i = 0; i < weights_.size(); ++i) matrix.coeffRef(i, i) += weights_[i];
  Eigen::ConjugateGradient<Matrix, Eigen::Lower, Eigen::IncompleteCholesky<double>> solver;
  constexpr double tolerance = 1e-9;
  solver.setTolerance(tolerance);
  solver.compute(matrix);
  return solver.solveWithGuess(weights_.cwiseProduct(measured_m_), guess);
}

SmoothHeights Smoothing::run(double curvature_sd_per_m, std::size_t most_rounds, const Work& work) {
  SmoothHeights result;
  result.curvature_sd_per_m = curvature_sd_per_m;
  const double bending = 1 / (curvature_sd_per_m * curvature_sd_per_m);
  Eigen::VectorXd z = measured_m_;
  for (; result.rounds < most_rounds && z.size() > 0; ++result.rounds) {
    const Eigen::VectorXd rows = derivatives_ * z;
    const Eigen::VectorXd weights = bending * (1 + bending * rows.array().square()).rsqrt();
    const Eigen::VectorXd next = solve(weights, z);
    const Eigen::ArrayXd moves = (next - z).array().abs();
    z = next;
    result.last_move_m = moves.maxCoeff();
    if (work.progress)
      work.progress(static_cast<double>(result.rounds + 1) / static_cast<double>(most_rounds));
    if ((moves.square() * weights_.array()).maxCoeff() < still_sds * still_sds) break;
  }
  result.heights_m.assign(numbers_.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < samples_.size(); ++i)
    result.heights_m[samples_[i]] = static_cast<float>(z[static_cast<Eigen::Index>(i)] + base_m_);
  return result;
}

}  // namespace

SmoothHeights smooth_dem(const GridFrame& frame, std::span<const float> heights_m,
                         std::span<const float> variance_m2, const SmoothOptions& options,
                         const Work& work) {
  check(frame, heights_m, variance_m2, options, work);
  Smoothing smoothing(frame, heights_m, variance_m2);
  const double k =
      options.curvature_sd_per_m ? *options.curvature_sd_per_m : smoothing.usual_curvature();
  return smoothing.run(k, options.most_rounds, work);
}

}  // namespace groundray
