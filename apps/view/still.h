#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/open.h"
#include "apps/view/view.h"

namespace groundray {

/// How pictures are taken without a window.
struct StillSpec {
  glm::ivec2 size_px{1280, 720};
  std::optional<glm::dvec3> from_w_m, at_w_m;  ///< else as what is opened is best seen
  std::optional<glm::dvec3> follow_w_m;        ///< whose terrain's levels; else the eye's
  std::vector<std::string> colour_by;  ///< COLUMN of all layers that have it, or LAYER=COLUMN
  /// What the colours of numbers span, where one of `colour_by` or "deviation" is shown.
  std::optional<glm::dvec2> range;
  std::vector<std::string> hide;  ///< layers by name, or what their names begin with
  bool is_wireframe = false;      ///< surfaces
  bool has_legend = true;
  std::optional<double> point_size_px;
};

/// Shows what was opened as StillSpec says. The terrain of a scene or a DEM is that for the eye.
/// @throws Error if no layer has a column, or none has a name that is to be hidden; or if the eye
///         is where it looks.
void arrange(View& view, std::vector<Opened>& inputs, const StillSpec& spec);

/// Writes the view as a PNG. @throws Error as View::picture, and if the file cannot be written.
void write_still(View& view, const std::filesystem::path& file, glm::ivec2 size_px);

/// Writes a turn round what is looked at, as 0000.png, 0001.png... in a folder, which is made.
/// @throws Error likewise; or if there are less than two pictures.
void write_turntable(View& view, const std::filesystem::path& folder, int pictures,
                     glm::ivec2 size_px);

/// Reads `WIDTHxHEIGHT`. @throws Error that names the option if it is none.
glm::ivec2 parse_size(const std::string& text);
/// Reads `LOW,HIGH`. @throws Error that names the option if it is none, or empty.
glm::dvec2 parse_range(const std::string& text);
/// Reads `X,Y,Z`. @param option  for the message. @throws Error likewise.
glm::dvec3 parse_place(const std::string& text, const std::string& option);

}  // namespace groundray
