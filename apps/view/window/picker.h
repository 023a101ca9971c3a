#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "apps/view/beam.h"
#include "apps/view/view.h"
#include "apps/view/window/fact_table.h"
#include "apps/view/window/job.h"
#include "apps/view/window/playback.h"

namespace groundray {

/// Tells of what was clicked: where it is and its numbers; of an echo all columns of its scan, and
/// its beam and footprint as layers.
class Picker {
 public:
  struct Hooks {
    std::function<void()> changed{};  ///< the view holds something else
    std::function<void(const std::string& title, const FactTable::Facts&)> told{};
    std::function<void(const EchoBeam&, const glm::dvec3& origin_w_m)> beam{};
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  is to outlive this.
  Picker(View& view, Hooks hooks);

  /// @param scan  what is known of the layer that was met; null if it is no scan.
  void pick(const Picked& picked, const ShownScan* scan);
  /// Takes back what the last click showed.
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
  std::filesystem::path file_;  // of the scan that was read last
  std::shared_ptr<const PointCloud> cloud_;
  Job job_;
};

/// Returns a beam as lines: from the sensor to the echo, its rim at both ends, and where it fell.
std::vector<Layer> beam_layers(const EchoBeam& beam, const glm::dvec3& origin_w_m);

}  // namespace groundray
