#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <string>
#include <utility>
#include <vector>

class QWidget;

namespace groundray {

/// Origins that the dialog offers, by name.
using KnownOrigins = std::vector<std::pair<std::string, glm::dvec3>>;

/// Asks for the origin of a layer's coordinates, in W, and calls `done` with it unless the user
/// cancels. Returns at once.
/// @param layer   name of the layer, for the title.
/// @param at_first  present origin.
void ask_for_origin(QWidget* parent, const std::string& layer, const glm::dvec3& at_first,
                    const KnownOrigins& known, std::function<void(const glm::dvec3&)> done);

}  // namespace groundray
