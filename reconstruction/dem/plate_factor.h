#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/dem/plate_dissection.h"

// Solves the equations of plates, private to this library.
namespace groundray {

/// A symmetric matrix: of each sample its equation's factors of samples, its own among them.
struct PlateMatrix {
  std::vector<std::size_t> ends;      ///< of each equation, in what follows
  std::vector<std::int32_t> samples;  ///< ascending for each equation
  std::vector<double> factors;

  std::size_t size() const noexcept { return ends.size(); }
  std::size_t begin_of(std::size_t row) const noexcept { return row == 0 ? 0 : ends[row - 1]; }

  /// Returns the matrix times z.
  std::vector<double> times(std::span<const double> z) const;
};

/// Whether what serves to change a factor later is kept, which takes half as much memory again.
enum class FactorUse : std::uint8_t { Once, Changing };

/// The factors L D L' of a matrix, or of what is left when some of its samples are left out.
/// Multifrontal: samples are eliminated part by part of a nested dissection, each part by dense
/// algebra; when other samples are left out, only the parts that these concern, and those after.
/// @see Duff, Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM
///      Trans. Math. Softw. 9 (1983).
class PlateFactor {
 public:
  /// @param matrix  must outlive this, as must the order.
  /// @param order   of all samples.
  PlateFactor(const PlateMatrix& matrix, const Dissection& order, FactorUse use);
  ~PlateFactor();
  PlateFactor(const PlateFactor&) = delete;
  PlateFactor& operator=(const PlateFactor&) = delete;

  /// Finds the factors; to be called again only if they are changing.
  /// @param is_left_out  of each sample 0 or 1.
  /// @throws Error if the equations have no solution.
  void factorise(std::span<const std::uint8_t> is_left_out);

  /// Returns z from what matrix times z is: of samples that are not left out; zero of others.
  std::vector<double> solve(std::span<const double> right) const;

 private:
  struct Part;
  std::vector<std::uint8_t> parts_to_do(std::span<const std::uint8_t> is_left_out) const;
  void gather(const DissectedPart& from, Part& part);
  void find_coupled(const DissectedPart& from, Part& part);

  const PlateMatrix& matrix_;
  const Dissection& order_;
  std::vector<std::int32_t> places_;  // in the order, of each sample
  std::vector<std::uint8_t> is_left_out_;
  std::vector<std::int32_t> local_;    // of places: rows of the part that is at hand
  std::vector<std::uint8_t> is_kept_;  // of parts: what they left, for the next time
  std::vector<Part> parts_;
};

}  // namespace groundray
