#include "reconstruction/dem/thin_plate/bounded_solver.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace groundray {
namespace {

constexpr int first_rounds = 30;     // of descent; ten suffice for most plates
constexpr int most_exchanges = 500;  // of pivoting, if descent does not suffice
// Descent then continues as long as this many rounds reduce the energy by more than a fraction of
// the total reduction.
constexpr int some_rounds = 100;
constexpr double least_fall = 1e-9;
constexpr int most_rounds = 10000;
constexpr double most_work = 4e7;  // samples times rounds, beyond a hundred rounds of each kind
constexpr int sweeps = 2;          // forward and backward, in which samples are moved one by one
// Fractions of the largest height that are attributed to rounding: of a height that follows from
// all equations, and of the move that one equation requests, which stiff forms amplify.
constexpr double least_move = 1e-10, least_push = 1e-14;

}  // namespace

BoundedSolver::BoundedSolver(const ThinPlateMatrix& matrix, const Dissection& order,
                             std::span<const double> right, std::span<const double> most)
    : matrix_(matrix),
      right_(right),
      most_(most),
      factor_(matrix, order, FactorUse::Changing),
      is_held_(matrix.size()),
      is_let_go_(matrix.size()) {
  for (std::size_t i = 0; i < matrix.size(); ++i)
    for (std::size_t k = matrix.begin_of(i); k < matrix.ends[i]; ++k)
      if (static_cast<std::size_t>(matrix.samples[k]) == i) own_.push_back(matrix.factors[k]);
}

// Returns the residuals of the equations.
std::vector<double> BoundedSolver::rest() const {
  std::vector<double> rest = matrix_.times(z_);
  std::ranges::transform(right_, rest, rest.begin(), std::minus<>());
  return rest;
}

// Moves each sample to its minimum with all others fixed: projected Gauss-Seidel.
void BoundedSolver::move_each() {
  const auto move = [this](std::size_t i) {
    double lacks = right_[i];
    for (std::size_t k = matrix_.begin_of(i); k < matrix_.ends[i]; ++k)
      lacks -= matrix_.factors[k] * z_[static_cast<std::size_t>(matrix_.samples[k])];
    z_[i] = std::min(z_[i] + lacks / own_[i], most_[i]);
  };
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < z_.size(); ++i) move(i);
    for (std::size_t i = z_.size(); i > 0; --i) move(i - 1);
  }
}

// Moves the samples that are not held towards the solution of their equations, as far as the energy
// decreases: either each one up to its bound, or all along a straight line until the first one
// reaches its bound, whichever leaves less energy. Returns whether no bound was in the way.
bool BoundedSolver::step() {
  const std::vector<double> lacks = rest();
  factor_.factorise(is_held_);
  const std::vector<double> whole = factor_.solve(lacks);
  std::vector<double> way = whole;
  bool is_whole = true;
  double straight = 1;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double most = most_[i] - z_[i];
    if (is_held_[i] != 0 || way[i] <= most) continue;
    is_whole &= way[i] <= most + least_move * largest_;
    straight = std::min(straight, most / way[i]);
    way[i] = most;
  }
  double length = 1;
  if (!is_whole) {
    const Stretch cut = best_stretch(way, lacks);
    const double falls = std::inner_product(whole.begin(), whole.end(), lacks.begin(), 0.0);
    const bool is_cut = cut.falls >= falls * straight * (1 - straight / 2);
    length = is_cut ? cut.length : straight;
    if (!is_cut) way = whole;
  }
  moved_ = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    moved_ = std::max(moved_, length * std::abs(way[i]));
    z_[i] = std::min(z_[i] + length * way[i], most_[i]);
  }
  return is_whole;
}

// Returns the fraction of `way` with the least energy.
BoundedSolver::Stretch BoundedSolver::best_stretch(std::span<const double> way,
                                                   std::span<const double> lacks) const {
  const std::vector<double> bent = matrix_.times(way);
  const double falls = std::inner_product(way.begin(), way.end(), lacks.begin(), 0.0);
  const double bends = std::inner_product(way.begin(), way.end(), bent.begin(), 0.0);
  const double length = bends > 0 ? std::clamp(falls / bends, 0.0, 1.0) : 0;
  return {length, length * (falls - length * bends / 2)};
}

// Returns whether a sample would fall if it were not held.
bool BoundedSolver::would_fall(std::size_t i, double lacks) const {
  return lacks < -least_push * largest_ * own_[i];
}

// Releases held samples that would fall. Returns whether there are none.
bool BoundedSolver::let_go() {
  const std::vector<double> lacks = rest();
  bool is_none = true;
  for (std::size_t i = 0; i < z_.size(); ++i) {
    is_let_go_[i] = is_held_[i] != 0 && would_fall(i, lacks[i]) ? 1 : 0;
    is_none &= is_let_go_[i] == 0;
  }
  return is_none;
}

// Performs rounds of descent. Returns whether the minimum was found.
bool BoundedSolver::descend(int rounds) {
  for (int round = 0; round < rounds; ++round) {
    move_each();
    for (std::size_t i = 0; i < z_.size(); ++i)
      is_held_[i] = z_[i] >= most_[i] && is_let_go_[i] == 0 ? 1 : 0;
    const bool is_whole = step();
    // If nothing moved, samples released before did not fall either, except for rounding.
    const bool is_still = round > 0 && moved_ <= least_move * largest_;
    if ((let_go() || is_still) && is_whole) return true;
  }
  return false;
}

// Sets held samples to their bounds and solves the equations of the others. Returns the samples on
// the wrong side: above their bounds, or held although they would fall.
std::vector<std::size_t> BoundedSolver::misplaced() {
  for (std::size_t i = 0; i < z_.size(); ++i)
    if (is_held_[i] != 0) z_[i] = most_[i];
  factor_.factorise(is_held_);
  const std::vector<double> way = factor_.solve(rest());
  std::ranges::transform(z_, way, z_.begin(), std::plus<>());
  const std::vector<double> lacks = rest();
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < z_.size(); ++i) {
    const bool is =
        is_held_[i] != 0 ? would_fall(i, lacks[i]) : z_[i] > most_[i] + least_move * largest_;
    if (is) found.push_back(i);
  }
  return found;
}

// Block principal pivoting: all samples on the wrong side change it, or only one if their number
// has not decreased for some rounds. Returns whether the minimum was found; otherwise heights stay
// unchanged.
bool BoundedSolver::exchange(int rounds) {
  constexpr int most_vain = 3;
  const std::vector<double> before = z_;
  std::size_t fewest = z_.size() + 1;
  for (int round = 0, vain = 0; round < rounds; ++round) {
    std::vector<std::size_t> wrong = misplaced();
    if (wrong.empty()) {
      std::ranges::transform(z_, most_, z_.begin(),
                             [](double z, double most) { return std::min(z, most); });
      return true;
    }
    vain = wrong.size() < fewest ? 0 : vain + 1;
    fewest = std::min(fewest, wrong.size());
    if (vain > most_vain) wrong.assign(1, wrong.back());
    for (const std::size_t i : wrong) is_held_[i] ^= 1;
  }
  z_ = before;
  return false;
}

double BoundedSolver::sum() const {
  const std::vector<double> lacks = rest();
  double sum = 0;
  for (std::size_t i = 0; i < z_.size(); ++i) sum -= z_[i] * (right_[i] + lacks[i]) / 2;
  return sum;
}

bool BoundedSolver::run(std::span<const double> start) {
  z_.assign(start.begin(), start.end());
  if (start.empty()) {
    factor_.factorise(is_held_);
    z_ = factor_.solve(right_);
  }
  largest_ = 0;
  bool is_free = true;
  for (std::size_t i = 0; i < z_.size(); ++i) {
    is_free &= z_[i] <= most_[i];
    const double lower = std::min(z_[i], most_[i]);
    largest_ = std::max({largest_, std::abs(z_[i]), std::abs(lower)});
    z_[i] = lower;
  }
  if (is_free && start.empty()) return true;
  const double first = sum();
  const auto no_more_than = [this](int rounds) {
    return std::clamp(static_cast<int>(most_work / static_cast<double>(z_.size())), some_rounds,
                      rounds);
  };
  if (descend(first_rounds) || exchange(no_more_than(most_exchanges))) return true;
  double before = sum();
  for (int done = 0; done < no_more_than(most_rounds); done += some_rounds) {
    if (descend(some_rounds)) return true;
    const double now = sum();
    if (before - now <= least_fall * (first - now)) return false;
    before = now;
  }
  return false;
}

}  // namespace groundray
