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
/// The sum never rises.
/// @see Graeser, Kornhuber, Multigrid methods for obstacle problems, J. Comput. Math. 27 (2009).
class PlateDescent {
 public:
  /// @param most  infinite for none. All must outlive this.
  PlateDescent(const PlateMatrix& matrix, const Dissection& order, std::span<const double> right,
               std::span<const double> most);

  /// Returns whether the least was found; else heights are within bounds, and not far from it.
  /// @param start  near it; or empty.
  bool run(std::span<const double> start);

  const std::vector<double>& heights() const noexcept { return z_; }

 private:
  void move_each();
  bool step();
  double best_length(std::span<const double> way, std::span<const double> lacks) const;
  bool let_go();
  std::vector<double> rest() const;

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
