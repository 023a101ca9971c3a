#pragma once

#include <QIcon>

class QApplication;

namespace groundray {

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
