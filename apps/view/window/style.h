#pragma once

#include <QColor>
#include <QIcon>
#include <algorithm>
#include <glm/vec3.hpp>

class QApplication;

namespace groundray {

/// A press of the mouse that moves so far is a drag.
inline constexpr int drag_begins_px = 4;

/// Steps in which bars show progress.
inline constexpr int progress_steps = 1000;

/// Returns a colour as Qt has it; its components are cut off at 0 and 1.
inline QColor colour_of(const glm::dvec3& colour) {
  return QColor::fromRgbF(std::clamp(colour.r, 0.0, 1.0), std::clamp(colour.g, 0.0, 1.0),
                          std::clamp(colour.b, 0.0, 1.0));
}

/// Gives the program its looks: dark and calm, so that colours of data stand out.
void set_style(QApplication& application);

/// What the toolbar's buttons show.
enum class Sign {
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
  Help,
  Play,
  Pause,
  Back,
  Forward,
  Close,
  Float
};

/// Returns a sign, drawn in lines.
QIcon icon_of(Sign sign);

}  // namespace groundray
