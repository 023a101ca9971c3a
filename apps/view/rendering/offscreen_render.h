#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/load_input.h"
#include "apps/view/rendering/view.h"

namespace groundray {

/// Options of what a view shows, for the window and for pictures without one.
struct ViewOptions {
  std::optional<glm::dvec3> from_w_m, at_w_m;  ///< default: as recommended for the inputs
  std::vector<std::string> colour_by;  ///< COLUMN for all layers that have it, or LAYER=COLUMN
  std::vector<std::string> hide;       ///< layers by name, or all those under a name in the tree
  std::optional<double> point_size_px;
  std::vector<FrameOrigin> origins;  ///< origins of meshes and clouds in local coordinates
  std::optional<ClipBox> clip;       ///< nothing outside it is drawn
  double exposure_ev = 0;            ///< brightens pictures by this power of 2
  bool is_wireframe = false;         ///< true to draw surfaces as wireframes
  bool has_eye_dome = false;         ///< true to draw with eye-dome lighting
  bool has_legend = true;
};

/// Options of pictures that are drawn without a window.
struct StillSpec {
  glm::ivec2 size_px{1280, 720};
  ViewOptions view;
  std::optional<glm::dvec3> follow_w_m;  ///< terrain's viewpoint; default: the eye
  /// Range of the colours, in layers that show a column of `colour_by` or "deviation".
  std::optional<glm::dvec2> range;
};

/// Returns a viewpoint with the eye and the target of the options, if these state any; the picture
/// is then upright or, seen from straight above or below, has north at the top.
Look requested_look(Look look, const ViewOptions& options);

/// Moves meshes and clouds to the requested origins.
/// @throws Error if a request applies to no input.
void place_inputs(std::vector<Opened>& inputs, const std::vector<FrameOrigin>& origins);

/// Adds the inputs to the view, as the options state. The terrain of the first input, if it has
/// one, is meshed for `follow_w_m` or the eye.
/// @throws Error if a requested column or layer does not exist, the eye is at its target,
///         `follow_w_m` is set but the first input has no terrain, or `range` is set but no layer
///         shows a column that it applies to.
void arrange(View& view, std::vector<Opened>& inputs, const StillSpec& spec);

/// Writes the view as a PNG file.
/// @throws Error as View::picture, and if the file cannot be written.
void write_still(View& view, const std::filesystem::path& file, glm::ivec2 size_px);

/// Writes pictures of a full turn round the target as 0000.png, 0001.png, ... into a folder, which
/// is created if necessary.
/// @throws Error as write_still; or if the number of pictures is not 2 to 9999, or the folder
///         cannot be created.
void write_turntable(View& view, const std::filesystem::path& folder, int pictures,
                     glm::ivec2 size_px);

/// Parses `WIDTHxHEIGHT`, px. @throws Error naming the option if the text is invalid.
glm::ivec2 parse_size(const std::string& text);
/// Parses `LOW,HIGH`. @throws Error naming the option if the text is invalid or the range is empty.
glm::dvec2 parse_range(const std::string& text);
/// Parses `X,Y,Z` or `INPUT=X,Y,Z`, m. @throws Error naming the option if the text is invalid.
FrameOrigin parse_origin(const std::string& text);
/// Parses the limits of a box: `X0,Y0,Z0,X1,Y1,Z1`, m. @throws Error naming the option if the text
/// is invalid or the box is empty.
ClipBox parse_box(const std::string& text);
/// Parses `X,Y,Z`, m.
/// @param option  name of the option, for the message.
/// @throws Error if the text is invalid.
glm::dvec3 parse_place(const std::string& text, const std::string& option);

}  // namespace groundray
