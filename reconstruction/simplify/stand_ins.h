#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

#include "reconstruction/simplify/convex_proof.h"
#include "reconstruction/simplify/workpiece.h"

namespace groundray {

/// A triangle of a surface: its number and its corners' vertices.
struct PlacedTriangle {
  std::uint32_t number = none;
  glm::uvec3 corners{0};
};

/// Keeps every point of an original within tolerance of the surface that it became, where the
/// tolerance between vertices is what lies between theirs: each triangle of the original is kept
/// with those of the surface that are proved to stand for it, and proved anew before one of them
/// goes.
class StandIns {
 public:
  /// @param piece      whose triangles stand for themselves; must outlive this.
  /// @param triangles  of the original, numbered as the piece's; must outlive this.
  StandIns(const Workpiece& piece, const std::vector<glm::uvec3>& triangles);

  /// Whether, instead of a star's triangles, these can stand for the original.
  /// @param fan  at least one.
  bool allow(const Star& star, const std::vector<PlacedTriangle>& fan);
  /// Notes that they do so, as was allowed last.
  void collapse(const Star& star);

 private:
  /// That a triangle of the surface is one of those that stand for a triangle of the original.
  struct Entry {
    std::uint32_t original = none;  // none if it is so no more
    std::uint32_t triangle = none;
    std::uint32_t next = none;          // of the same triangle of the surface
    std::uint32_t next_of_same = none;  // original
  };
  /// Of a vertex of the original: which of the fan is nearest.
  struct Nearest {
    std::uint32_t asked = 0;  // which fan
    std::uint32_t of_fan = 0;
    double distance_m = 0;
  };
  friend class ConvexProof<StandIns>;

  ProofCorner corner(const ProofCorner& a, const ProofCorner& b, double share) const;
  double excess_m(const ProofCorner& corner, std::uint32_t candidate) const;
  void use(std::uint32_t candidate);

  ProofCorner corner_at(std::uint32_t vertex);
  double distance_m(const glm::dvec3& p_m, std::uint32_t candidate) const;
  void choose_nearest(ProofCorner& corner, std::size_t first) const;
  bool stands(const Star& star, std::uint32_t original);
  bool covers(const glm::uvec3& original, std::uint32_t nearest);
  void add_candidate(const PlacedTriangle& triangle);
  void add(std::uint32_t original, std::uint32_t triangle);
  void free(std::uint32_t entry);
  std::uint32_t& clean(std::uint32_t& link);

  const Workpiece& piece_;
  const std::vector<glm::uvec3>& triangles_;
  std::vector<std::uint32_t> firsts_;     // of each triangle of the surface: entry
  std::vector<std::uint32_t> firsts_of_;  // of each triangle of the original
  std::vector<Entry> entries_;
  std::uint32_t free_ = none;

  // Of the fan that is asked about:
  std::uint32_t asked_ = 0;
  std::size_t fan_size_ = 0;
  /// A triangle of the surface that may stand for one of the original.
  struct Candidate {
    PlacedTriangle triangle;
    std::array<glm::dvec3, 3> corners_m{};
  };
  std::vector<Candidate> candidates_;    // the fan, then what else stands for a triangle
  std::vector<Nearest> nearest_;         // of each vertex of the original
  std::vector<std::uint32_t> asked_of_;  // of each triangle of the original: latest fan
  std::vector<std::uint32_t> used_;      // candidates, for the triangle that is looked at
  std::vector<std::pair<std::uint32_t, std::uint32_t>> proved_;  // originals and their stand-ins
  ConvexProof<StandIns> proof_;
};

}  // namespace groundray
