#include "apps/view/window/recent_files.h"

#include <QSettings>
#include <QStringList>
#include <algorithm>
#include <system_error>

namespace groundray {
namespace {

const QString key = QStringLiteral("recent");

QString path_text(const std::filesystem::path& path) {
  return QString::fromStdString(path.string());
}

std::filesystem::path whole_path(const std::filesystem::path& path) {
  std::error_code fault;
  std::filesystem::path whole = std::filesystem::absolute(path, fault).lexically_normal();
  if (fault) return path;
  return whole.has_filename() ? whole : whole.parent_path();  // without a trailing slash
}

}  // namespace

RecentFiles::RecentFiles(std::filesystem::path file) : file_(std::move(file)) {
  if (file_.empty()) return;
  const QSettings kept(path_text(file_), QSettings::IniFormat);
  for (const QString& path : kept.value(key).toStringList()) {
    if (paths_.size() < most_files && !path.isEmpty()) paths_.emplace_back(path.toStdString());
  }
}

void RecentFiles::add(const std::filesystem::path& path) {
  const std::filesystem::path added = whole_path(path);
  std::erase(paths_, added);
  paths_.insert(paths_.begin(), added);
  if (paths_.size() > most_files) paths_.resize(most_files);
  keep();
}

void RecentFiles::clear() {
  paths_.clear();
  keep();
}

void RecentFiles::keep() const {
  if (file_.empty()) return;
  QStringList texts;
  for (const std::filesystem::path& path : paths_) texts << path_text(path);
  QSettings kept(path_text(file_), QSettings::IniFormat);
  kept.setValue(key, texts);
}

}  // namespace groundray
