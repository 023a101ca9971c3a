#pragma once

#include <QString>

class QWidget;

namespace groundray {

/// Returns the description of mouse and keyboard commands, as HTML.
QString help_text();

/// Shows the description in a dialog.
void show_help(QWidget* parent);

}  // namespace groundray
