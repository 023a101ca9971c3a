#include "apps/golden/report.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace groundray::golden {

const char* word_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::Passed:
      return "passed";
    case Verdict::Failed:
      return "failed";
    case Verdict::Told:
      break;
  }
  return "told";
}

Verdict verdict_of(const std::vector<Measure>& measures) {
  const auto any = [&](Verdict verdict) {
    return std::ranges::find(measures, verdict, &Measure::verdict) != measures.end();
  };
  if (any(Verdict::Failed)) return Verdict::Failed;
  return any(Verdict::Passed) ? Verdict::Passed : Verdict::Told;
}

void tell(Section& into, std::string name, double value, std::string unit) {
  into.measures.push_back({.name = std::move(name),
                           .value = value,
                           .unit = std::move(unit),
                           .limit = {},
                           .because = {},
                           .verdict = Verdict::Told});
}

void hold(Section& into, std::string name, double value, std::string unit, double limit,
          std::string because) {
  into.measures.push_back({.name = std::move(name),
                           .value = value,
                           .unit = std::move(unit),
                           .limit = limit,
                           .because = std::move(because),
                           .verdict = value <= limit ? Verdict::Passed : Verdict::Failed});
}

void fail(Section& into, std::string name, double value, std::string unit, std::string because) {
  into.measures.push_back({.name = std::move(name),
                           .value = value,
                           .unit = std::move(unit),
                           .limit = {},
                           .because = std::move(because),
                           .verdict = Verdict::Failed});
}

Histogram histogram_of(std::string title, std::string unit, const std::vector<double>& values,
                       double low, double high, std::size_t bins) {
  Histogram histogram{.title = std::move(title),
                      .unit = std::move(unit),
                      .low = low,
                      .high = high,
                      .counts = std::vector<std::uint64_t>(bins)};
  const bool has_steps = bins > 0 && high > low && std::isfinite(high - low);
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (value < low) {
      ++histogram.below;
    } else if (value > high || !has_steps) {
      ++histogram.above;
    } else {  // the last step includes its upper limit
      const double place = (value - low) / (high - low) * static_cast<double>(bins);
      ++histogram.counts[std::min(static_cast<std::size_t>(place), bins - 1)];
    }
  }
  return histogram;
}

}  // namespace groundray::golden
