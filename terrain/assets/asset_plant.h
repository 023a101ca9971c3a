#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string_view>
#include <vector>

#include "core/model/model.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_skeleton.h"

namespace groundray {

/// Place of a spray, a twig with its leaves: it extends from `base` in the direction of `along`.
struct Spray {
  glm::dvec3 base;
  glm::dvec3 along;  ///< unit
  glm::dvec3 side;   ///< unit, perpendicular to `along`
};

/// Returns a spray with the given directions, which need not be unit or perpendicular.
Spray spray_on(const glm::dvec3& base, const glm::dvec3& along, const glm::dvec3& sideways);

/// Distribution of the angle between a leaf's normal and the vertical. Azimuths are uniform.
/// @see de Wit, Photosynthesis of leaf canopies (1965), for the first three.
enum class LeafAngles : std::uint8_t {
  Planophile,   ///< density proportional to 1 + cos 2x: mostly horizontal
  Plagiophile,  ///< to 1 - cos 4x: mostly oblique
  Spherical,    ///< to sin x
  AroundTwig    ///< any direction perpendicular to the leaf, as for needles
};

/// Leaf or bundle of needles as geometry, and the twig that holds it.
struct LeafForm {
  LeafAngles angles = LeafAngles::Plagiophile;
  bool is_needle = false;   ///< one pointed triangle; else an ovate leaf of four triangles
  double length_m = 0.07;   ///< natural length
  double width = 0.5;       ///< of its length
  double angle_rad = 0.95;  ///< between leaf and twig
  double first = 0.1;       ///< place of a twig's first leaf, as a fraction of the twig
  int per_twig = 12;
  double twig_m = 0.3;        ///< length of a twig
  double sag = 0;             ///< of the twig's tip, as a fraction of its length
  std::size_t most = 45'000;  ///< largest number of leaves, for `detail` 1
};

/// Parts of a plant. Its height is about `height`; the unit of length is arbitrary.
struct Plant {
  Skeleton wood;
  std::vector<Spray> sprays;
  SprayKind spray = SprayKind::Leaves;
  LeafForm leaf{};
  double height = 1;
  std::size_t wood_budget = 0;  ///< triangles of the wood, if leaves are cards
  std::size_t coarseness = 1;   ///< then too: multiplies the distance between rings of the wood
};

/// Returns `usual` times `detail`, rounded.
std::size_t scaled_count(double usual, double detail);

/// Returns the number of sprays to place on the plant's wood: as many cards as `usual` times
/// `detail`, or, for leaves as geometry, as many twigs as bear the requested leaf area with leaves
/// of natural length, or at most `leaf.most` times `detail` leaves.
std::size_t spray_count(const Plant& plant, const AssetShape& shape, double usual);

/// Assembles a plant: wood as closed tubes, named `bark` or, on a dead plant, `wood`; sprays as
/// cards or geometry. The size of cards or leaves gives the leaf area index times `health`.
Model assemble(const Plant& plant, AssetShape& shape);

}  // namespace groundray
