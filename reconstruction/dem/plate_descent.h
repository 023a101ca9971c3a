#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/plate_factor.h"

// Plates below bounds, private to this library.
namespace groundray {

/// Looks for the z <= most with the least of z' matrix z / 2 - right' z, by truncated nonsmooth
/// Newton steps: heights are lowered or let rise one by one, those that meet their bounds are held
/// there, the rest goes where its equations lead it, as far as bounds let it and the sum gets less.
/// The sum never rises. Where 30 such rounds do not do, those held and those free are found by
/// block principal pivoting: up to 500 rounds in which samples on the wrong side change it. If that
/// fails, too, descent goes on until 100 rounds take less than 1e-9 of all that was taken off the
/// sum, or for 10 000 rounds. Of both sorts of rounds there are no more than 4e7 over the number of
/// samples, but for a hundred.
/// @see Graeser, Kornhuber, Multigrid methods for obstacle problems, J. Comput. Math. 27 (2009);
///      Judice, Pires, A block principal pivoting algorithm for large-scale strictly monotone
///      linear complementarity problems, Comput. Oper. Res. 21 (1994).
class PlateDescent {
 public:
  /// @param most  infinite for none. All must outlive this.
  PlateDescent(const PlateMatrix& matrix, const Dissection& order, std::span<const double> right,
               std::span<const double> most);

  /// Returns whether the least was found; else heights are within bounds, and the sum is no more
  /// than it was at the start, but heights may be far from those of the least.
  /// @param start  near it; or empty.
  bool run(std::span<const double> start);

  const std::vector<double>& heights() const noexcept { return z_; }

 private:
  struct Stretch {
    double length = 0;  // of a way, as a share of it
    double falls = 0;   // what it takes off the sum
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

  const PlateMatrix& matrix_;
  std::span<const double> right_, most_;
  std::vector<double> own_;  // the diagonal
  PlateFactor factor_;
  std::vector<double> z_;
  std::vector<std::uint8_t> is_held_, is_let_go_;
  double largest_ = 0;  // of heights and bounds, about
  double moved_ = 0;    // by the latest step, at most
};

}  // namespace groundray
