#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/line_field.h"
#include "core/random.h"
#include "terrain/trail/bank_profile.h"

namespace groundray {

/// Trail over the ground: its line, its banks and what traffic and weather did to it. Lengths in
/// metres; the equations are in docs/reference/trails.md.
struct TrailSpec {
  /// Two wheel tracks, pressed into the ground.
  struct Ruts {
    double track_m = 1.6;   ///< distance of their centres
    double width_m = 0.35;  ///< of each
    double depth_m = 0.06;
    double berm_m = 0.02;  ///< height of the ridges on both sides of each
  };
  /// Ripples across a dirt road.
  struct Washboard {
    double wavelength_m = 0.7;
    double amplitude_m = 0.015;  ///< half of the height from trough to crest
  };
  /// Bowls at random places on the carriageway.
  struct Potholes {
    double per_100_m = 5;           ///< expected number
    glm::dvec2 diameter_m{0.4, 1};  ///< uniformly distributed between these
    double depth_m = 0.08;          ///< of the largest; in proportion to the diameter
  };
  /// Ditches beside the carriageway.
  struct Ditches {
    enum class Side : std::uint8_t { Both, Left, Right };
    double width_m = 1;
    double depth_m = 0.3;
    Side side = Side::Both;
  };
  /// Roots that cross the trail.
  struct Roots {
    double per_100_m = 10;  ///< expected number
    double width_m = 0.12;
    double height_m = 0.04;
  };

  std::string name;
  std::vector<glm::dvec2> waypoints_m;  ///< in W; the line is a SmoothCurve through them
  /// Ends in W between which `find_route` chooses the waypoints; then there are none.
  std::optional<std::array<glm::dvec2, 2>> between_m{};
  double width_m = 3;         ///< of the carriageway
  double raised_m = 0;        ///< height above the levelled ground; negative for a bed of a creek
  double level_over_m = 10;   ///< length over which heights along the line are averaged
  double bank_slope = 0.67;   ///< rise over run of cuttings and embankments
  double most_bank_m = 2;     ///< largest height of a cutting or embankment
  double most_grade = 0.47;   ///< largest rise over run along the line
  double crown_m = 0;         ///< height of the middle above the sides
  double relief_share = 0.3;  ///< share of the ground's relief that remains on it
  double variation = 0;       ///< of the ruts along the line, 0 to 1
  std::optional<Ruts> ruts{};
  std::optional<Washboard> washboard{};
  std::optional<Potholes> potholes{};
  std::optional<Ditches> ditches{};
  std::optional<Roots> roots{};
  std::optional<Benches> benches{};  ///< of the banks
  Seed variant{};  ///< selects the variation, setbacks of benches, and places of potholes and roots
};

/// Trail as a function of place: changes the height of the ground near its line. Immutable; any
/// number of threads may query it.
class Trail {
 public:
  /// Function that returns the height of the ground without the trail at a point of D, metres, or
  /// nothing where there is none.
  using GroundHeight = std::function<std::optional<double>(glm::dvec2 p)>;

  /// @param origin_w_m  position of D in W.
  /// @param cell_m      size of the cells that will represent it.
  /// @throws Error as find_route; or listing every value that is out of bounds, and details
  /// narrower than two cells;
  ///         or if the line leaves the ground, is too steep, or needs too high a bank, with the
  ///         place in W.
  Trail(const TrailSpec& spec, const GroundHeight& ground, glm::dvec2 origin_w_m, double cell_m);

  /// Returns the specification, with all waypoints.
  const TrailSpec& spec() const noexcept { return spec_; }
  /// Returns the field of places beside it, within which it changes the ground; in D.
  const LineField& field() const noexcept { return field_; }
  /// Returns the height of its sides at points of field().line(), metres.
  const std::vector<double>& levels_m() const noexcept { return levels_m_; }

  /// Ground at a point.
  struct Shape {
    double height_m = 0;
    double relief_share = 1;  ///< share of the relief that is added to it
  };
  /// Changes the ground at a point `p` of D; not where there is none, i.e. the height is NaN.
  void apply(glm::dvec2 p, Shape& ground) const noexcept;

 private:
  struct Pothole {
    LinePlace at;
    double radius_m, depth_m;
  };
  struct Root {
    LinePlace at;
    glm::dvec2 along;  // unit vector of its direction: along and across the trail
    double half_length_m;
  };
  void level(const GroundHeight& ground, glm::dvec2 origin_w_m);
  void vary();
  void place_details();
  double detail_m(const LinePlace& at) const noexcept;
  double rut_m(const LinePlace& at) const noexcept;
  double along(const std::vector<double>& values, double along_m) const noexcept;
  double edge_m(double across_m) const noexcept;

  TrailSpec spec_;
  BankProfile bank_;
  LineField field_;
  std::vector<double> levels_m_;           // by point of the line
  std::vector<double> depths_, shifts_m_;  // of the ruts, likewise; depths relative to their depth
  std::vector<Pothole> potholes_;          // in order along the line
  std::vector<Root> roots_;                // likewise
};

}  // namespace groundray
