#pragma once

#include <QColor>
#include <QIcon>
#include <algorithm>
#include <glm/vec3.hpp>

class QApplication;

namespace groundray {

/// Distance from which a mouse movement with a pressed button is a drag.
inline constexpr int drag_begins_px = 4;

/// Returns a colour for Qt; its components are clamped to [0, 1].
inline QColor colour_of(const glm::dvec3& colour) {
  return QColor::fromRgbF(std::clamp(colour.r, 0.0, 1.0), std::clamp(colour.g, 0.0, 1.0),
                          std::clamp(colour.b, 0.0, 1.0));
}

/// Sets the appearance of the program: dark and unsaturated, so that the colours of data stand out.
void set_style(QApplication& application);

/// Icons of buttons.
enum class Icon {
  Open,
  OpenFolder,
  Save,
  Fit,
  Top,
  South,
  East,
  Oblique,
  Wireframe,
  Legend,
  Scan,
  Compare,
  Measure,
  Clip,
  EyeDome,
  Help,
  Play,
  Pause,
  Back,
  Forward,
  Close,
  Float
};

/// Returns an icon, drawn in lines.
QIcon icon_of(Icon icon);

}  // namespace groundray
