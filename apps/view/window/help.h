#pragma once

#include <QString>

class QWidget;

namespace groundray {

/// Returns what the mouse and the keys do, as HTML.
QString help_text();

/// Shows it.
void show_help(QWidget* parent);

}  // namespace groundray
