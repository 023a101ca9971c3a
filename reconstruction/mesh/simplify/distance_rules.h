#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/tracing/closest_point.h"
#include "reconstruction/mesh/accuracy/cover_bound.h"
#include "reconstruction/mesh/simplify/convex_proof.h"
#include "reconstruction/mesh/simplify/decimation_state.h"
#include "reconstruction/mesh/simplify/distance_proof.h"

namespace groundray {

/// Triangle of a surface: its number and its corners' vertices.
struct PlacedTriangle {
  std::uint32_t number = none;
  glm::uvec3 corners{0};
};

/// Keeps every point of an original within tolerance of the surface that it became; tolerances are
/// interpolated between vertices. Each triangle of the original is stored with the triangles of the
/// surface that are proved to represent it, and is proved again before one of these is removed.
class FaceCorrespondence {
 public:
  /// @param piece      its triangles initially represent themselves; must outlive this.
  /// @param triangles  of the original, numbered as the piece's; must outlive this.
  FaceCorrespondence(const DecimationState& piece, const std::vector<glm::uvec3>& triangles);

  /// Returns true if these triangles, instead of a star's, can represent the original.
  /// @param fan  at least one.
  bool allow(const Star& star, const std::vector<PlacedTriangle>& fan);
  /// Records that they do, as was allowed last.
  void collapse(const Star& star);

 private:
  /// Link between a triangle of the surface and a triangle of the original that it represents.
  struct Entry {
    std::uint32_t original = none;  // none if no longer valid
    std::uint32_t triangle = none;
    std::uint32_t next = none;          // of the same triangle of the surface
    std::uint32_t next_of_same = none;  // of the same original
  };
  /// Fan triangle nearest to a vertex of the original.
  struct Nearest {
    std::uint32_t asked = 0;  // number of the fan
    std::uint32_t of_fan = 0;
    double distance_m = 0;
  };
  friend class ConvexProof<FaceCorrespondence>;

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

  const DecimationState& piece_;
  const std::vector<glm::uvec3>& triangles_;
  std::vector<std::uint32_t> firsts_;     // of each triangle of the surface: first entry
  std::vector<std::uint32_t> firsts_of_;  // of each triangle of the original: first entry
  std::vector<Entry> entries_;
  std::uint32_t free_ = none;

  // For the fan being tested:
  std::uint32_t asked_ = 0;
  std::size_t fan_size_ = 0;
  /// Triangle of the surface that may represent one of the original.
  struct Candidate {
    PlacedTriangle triangle;
    std::array<glm::dvec3, 3> corners_m{};
  };
  std::vector<Candidate> candidates_;    // the fan, then others that represent a triangle
  std::vector<Nearest> nearest_;         // of each vertex of the original
  std::vector<std::uint32_t> asked_of_;  // of each triangle of the original: latest fan
  std::vector<std::uint32_t> used_;      // candidates, for the triangle being tested
  std::vector<std::pair<std::uint32_t, std::uint32_t>> proved_;  // originals and their stand-ins
  ConvexProof<FaceCorrespondence> proof_;
};

/// Keeps every point of a surface within tolerance of the original, and every point of the original
/// within tolerance of the surface. Each triangle is proved before it is created; a collapse is
/// rejected if a few parts do not suffice for the proof.
class DistanceRules final : public CollapseRules {
 public:
  /// @param piece     must outlive this.
  /// @param original  initial mesh of the piece, with vertices and triangles in the same order;
  ///                  must outlive this.
  /// @param border_m  permitted displacement of boundaries, including those between labels; each
  ///                  vertex's tolerance if it is not given.
  DistanceRules(DecimationState& piece, const ClosestPoint& original,
                std::optional<double> border_m);

  bool allow(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;
  void collapse(const Star& star, const FeatureLines::Crossing& crossing, std::size_t to) override;

 private:
  void set_fan(const Star& star, std::size_t to);
  bool keeps_line();
  bool is_near_original(const Star& star);

  DecimationState& piece_;
  const ClosestPoint& original_;
  std::optional<double> border_m_;
  ShapeRules shape_;
  FaceCorrespondence stand_ins_;
  CoverBound cover_;
  NearSurface near_original_;

  // For the collapse being tested:
  std::vector<PlacedTriangle> fan_;
  FeatureLines::Merged line_;
};

}  // namespace groundray
