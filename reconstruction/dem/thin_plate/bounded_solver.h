#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/thin_plate/ldlt.h"

// Plates below bounds, private to this library.
namespace groundray {

/// Minimiser of the energy z' matrix z / 2 - right' z under the bounds z <= most, by truncated
/// nonsmooth Newton steps, which never increase the energy, or, if 30 of these do not suffice, by
/// block principal pivoting, and more such steps if that fails, too: see docs/theory/dem_fill.md.
/// Rounds are limited to 4e7 divided by the number of samples, but not to less than a hundred.
/// @see Graeser, Kornhuber, Multigrid methods for obstacle problems, J. Comput. Math. 27 (2009);
///      Judice, Pires, A block principal pivoting algorithm for large-scale strictly monotone
///      linear complementarity problems, Comput. Oper. Res. 21 (1994).
class BoundedSolver {
 public:
  /// @param most  upper bounds, infinite for none. All arguments must outlive this.
  BoundedSolver(const ThinPlateMatrix& matrix, const Dissection& order,
                std::span<const double> right, std::span<const double> most);

  /// Returns whether the minimum was found. Otherwise heights are within bounds, and the energy is
  /// no larger than at the start, but heights may be far from the minimum.
  /// @param start  heights near the minimum; or empty.
  bool run(std::span<const double> start);

  const std::vector<double>& heights() const noexcept { return z_; }

 private:
  struct Stretch {
    double length = 0;  // fraction of the way
    double falls = 0;   // reduction of the energy
  };
  void move_each();
  bool step();
  Stretch best_stretch(std::span<const double> way, std::span<const double> lacks) const;
  bool would_fall(std::size_t i, double lacks) const;
  bool let_go();
  bool descend(int rounds);
  std::vector<std::size_t> misplaced();
  bool exchange(int rounds);
  std::vector<double> rest() const;
  double sum() const;

  const ThinPlateMatrix& matrix_;
  std::span<const double> right_, most_;
  std::vector<double> own_;  // diagonal of the matrix
  LdltFactor factor_;
  std::vector<double> z_;
  std::vector<std::uint8_t> is_held_, is_let_go_;
  double largest_ = 0;  // largest height or bound, approximately
  double moved_ = 0;    // largest move of the latest step
};

}  // namespace groundray
