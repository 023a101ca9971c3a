#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

// Direct solver for the equations of plates, private to this library.
namespace groundray {

/// Samples that are eliminated together, after the two other parts that they separate.
struct DissectedPart {
  std::size_t begin = 0, end = 0;       ///< range in the order
  std::vector<std::size_t> children{};  ///< two or none, which precede this part
};

/// Fill-reducing order of samples for eliminating equations that couple neighbours.
struct Dissection {
  std::vector<std::int32_t> order;   ///< numbers of samples
  std::vector<DissectedPart> parts;  ///< the last one is the root
};

/// Returns a nested dissection: separators that divide the other samples into two halves come last,
/// and so on within the halves.
/// @param places  columns and rows; not empty.
/// @param reach  largest distance of samples coupled by an equation, in columns or rows.
/// @see George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973).
Dissection dissect(std::span<const glm::ivec2> places, int reach);

/// Symmetric sparse matrix: each sample's equation consists of samples and their factors, its own
/// among them.
struct ThinPlateMatrix {
  std::vector<std::size_t> ends;      ///< end of each equation in the columns below
  std::vector<std::int32_t> samples;  ///< ascending for each equation
  std::vector<double> factors;

  std::size_t size() const noexcept { return ends.size(); }
  std::size_t begin_of(std::size_t row) const noexcept { return row == 0 ? 0 : ends[row - 1]; }

  /// Returns the matrix times z.
  std::vector<double> times(std::span<const double> z) const;
};

/// Use of a factorisation: Changing keeps data for later changes, which takes half as much memory
/// again.
enum class FactorUse : std::uint8_t { Once, Changing };

/// L D L' factorisation of a matrix, or of the remainder when some of its samples are excluded.
/// Multifrontal: samples are eliminated part by part of a nested dissection, each part by dense
/// algebra. When other samples are excluded, only the parts concerned and those after them are
/// recomputed.
/// @see Duff, Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM
///      Trans. Math. Softw. 9 (1983).
class LdltFactor {
 public:
  /// @param matrix  must outlive this, as must the order.
  /// @param order  dissection of all samples.
  LdltFactor(const ThinPlateMatrix& matrix, const Dissection& order, FactorUse use);
  ~LdltFactor();
  LdltFactor(const LdltFactor&) = delete;
  LdltFactor& operator=(const LdltFactor&) = delete;

  /// Computes the factors; to be called again only with FactorUse::Changing.
  /// @param is_left_out  0 or 1 for each sample.
  /// @throws Error if the equations have no solution.
  void factorise(std::span<const std::uint8_t> is_left_out);

  /// Returns the z for which matrix times z is `right`, for samples that are not excluded; zero for
  /// the others.
  std::vector<double> solve(std::span<const double> right) const;

 private:
  struct Part;
  std::vector<std::uint8_t> parts_to_do(std::span<const std::uint8_t> is_left_out) const;
  void gather(const DissectedPart& from, Part& part);
  void find_coupled(const DissectedPart& from, Part& part);

  const ThinPlateMatrix& matrix_;
  const Dissection& order_;
  std::vector<std::int32_t> places_;  // position of each sample in the order
  std::vector<std::uint8_t> is_left_out_;
  std::vector<std::int32_t> local_;    // row in the current part, by position
  std::vector<std::uint8_t> is_kept_;  // of parts: 1 if the update matrix is kept
  std::vector<Part> parts_;
};

}  // namespace groundray
