#pragma once

class QWidget;

namespace groundray {

/// Shows what the mouse and the keys do.
void show_help(QWidget* parent);

}  // namespace groundray
