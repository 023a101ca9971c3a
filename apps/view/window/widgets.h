#pragma once

#include <fmt/format.h>

#include <QBoxLayout>
#include <QLabel>
#include <QProgressBar>
#include <QString>
#include <initializer_list>
#include <utility>

namespace groundray {

/// Number of steps of a progress bar.
inline constexpr int progress_steps = 1000;

/// Formats a text as fmt::format().
template <typename... Values>
QString text_of(fmt::format_string<Values...> format, Values&&... values) {
  return QString::fromStdString(fmt::format(format, std::forward<Values>(values)...));
}

/// Gives a widget a name, by which tests find it, and a tool tip.
template <typename Widget>
Widget* named(Widget* widget, const char* name, const char* tip = "") {
  widget->setObjectName(name);
  widget->setToolTip(tip);
  return widget;
}

/// Returns a label that wraps its text.
inline QLabel* wrapped_label(const QString& text = {}) {
  auto* label = new QLabel(text);
  label->setWordWrap(true);
  return label;
}

/// Returns a progress bar of `progress_steps` steps.
inline QProgressBar* progress_bar() {
  auto* bar = new QProgressBar;
  bar->setRange(0, progress_steps);
  return bar;
}

/// Adds widgets to a layout, one after the other.
inline void add_widgets(QBoxLayout& layout, std::initializer_list<QWidget*> widgets) {
  for (QWidget* each : widgets) layout.addWidget(each);
}

}  // namespace groundray
