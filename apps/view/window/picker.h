#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "apps/view/echo_beam.h"
#include "apps/view/rendering/view.h"
#include "apps/view/window/job.h"
#include "apps/view/window/panels/fact_table.h"
#include "apps/view/window/playback.h"

namespace groundray {

/// Shows the element that was clicked: its position and values; for an echo all columns of its
/// scan, and its beam and footprint as layers.
class Picker {
 public:
  struct Hooks {
    std::function<void()> changed{};  ///< the layers of the view have changed
    std::function<void(const std::string& title, const FactTable::Facts&)> facts{};
    std::function<void(const EchoBeam&, const glm::dvec3& origin_w_m)> beam{};
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  must outlive this.
  Picker(View& view, Hooks hooks);

  /// @param scan  scan of the picked layer; null if it is not a scan.
  void pick(const Picked& picked, const ShownScan* scan);
  /// Removes the display of the last click.
  void clear();
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  struct Echo {
    FactTable::Facts facts;
    EchoBeam beam;
    std::shared_ptr<const PointCloud> cloud;
  };

  void show_row(const Layer& layer, const Picked& picked);
  void show_echo(const Layer& layer, const Picked& picked, const ShownScan& scan);
  void mark(const glm::dvec3& p_w_m);

  View& view_;
  Hooks hooks_;
  std::filesystem::path file_;  // file of the scan that was read last
  std::shared_ptr<const PointCloud> cloud_;
  Job job_;
};

}  // namespace groundray
