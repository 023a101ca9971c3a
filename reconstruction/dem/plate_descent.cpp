#include "reconstruction/dem/plate_descent.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace groundray {
namespace {

constexpr int most_rounds = 100;
constexpr int sweeps = 2;  // there and back, of samples moved one by one
// Shares of the largest height that are no more than rounding: of a height that follows from all
// equations, and of the move that one equation asks for, which stiff forms make much of.
constexpr double least_move = 1e-10, least_push = 1e-14;

}  // namespace

PlateDescent::PlateDescent(const PlateMatrix& matrix, const Dissection& order,
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

// What the equations lack.
std::vector<double> PlateDescent::rest() const {
  std::vector<double> rest = matrix_.times(z_);
  std::ranges::transform(right_, rest, rest.begin(), std::minus<>());
  return rest;
}

// Moves each sample to its least with all others where they are: projected Gauss-Seidel.
void PlateDescent::move_each() {
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

// Moves those that are not held to where their equations lead them, cut off at the bounds and as
// far as the sum gets less. Whether nothing had to be cut off.
bool PlateDescent::step() {
  const std::vector<double> lacks = rest();
  factor_.factorise(is_held_);
  std::vector<double> way = factor_.solve(lacks);
  bool is_whole = true;
  for (std::size_t i = 0; i < way.size(); ++i) {
    const double most = most_[i] - z_[i];
    if (is_held_[i] != 0 || way[i] <= most) continue;
    is_whole &= way[i] <= most + least_move * largest_;
    way[i] = most;
  }
  const double length = is_whole ? 1 : best_length(way, lacks);
  moved_ = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    moved_ = std::max(moved_, length * std::abs(way[i]));
    z_[i] = std::min(z_[i] + length * way[i], most_[i]);
  }
  return is_whole;
}

// How far to go a way, as a share of it, for the least sum.
double PlateDescent::best_length(std::span<const double> way, std::span<const double> lacks) const {
  const std::vector<double> bent = matrix_.times(way);
  const double falls = std::inner_product(way.begin(), way.end(), lacks.begin(), 0.0);
  const double bends = std::inner_product(way.begin(), way.end(), bent.begin(), 0.0);
  return bends > 0 ? std::clamp(falls / bends, 0.0, 1.0) : 0;
}

// Lets samples go that would fall. Whether there are none.
bool PlateDescent::let_go() {
  const std::vector<double> lacks = rest();
  bool is_none = true;
  for (std::size_t i = 0; i < z_.size(); ++i) {
    is_let_go_[i] = is_held_[i] != 0 && lacks[i] < -least_push * largest_ * own_[i] ? 1 : 0;
    is_none &= is_let_go_[i] == 0;
  }
  return is_none;
}

bool PlateDescent::run(std::span<const double> start) {
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
  for (int round = 0; round < most_rounds; ++round) {
    move_each();
    for (std::size_t i = 0; i < z_.size(); ++i)
      is_held_[i] = z_[i] >= most_[i] && is_let_go_[i] == 0 ? 1 : 0;
    const bool is_whole = step();
    // Those let go before did not fall either, but for rounding, if nothing moved.
    const bool is_still = round > 0 && moved_ <= least_move * largest_;
    if ((let_go() || is_still) && is_whole) return true;
  }
  return false;
}

}  // namespace groundray
