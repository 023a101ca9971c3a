#include "reconstruction/dem/fill/dem_fill.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <map>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "reconstruction/dem/fill/fill_calibration.h"
#include "reconstruction/dem/fill/fill_error_model.h"
#include "reconstruction/dem/fill/holdout_mask.h"
#include "reconstruction/dem/fill/sorted_holes.h"
#include "reconstruction/dem/thin_plate/thin_plate_system.h"

namespace groundray {
namespace {

constexpr double long_shape = 15;       // area / (largest distance to data)²; a disc has 3
constexpr double usual_tension = 0.05;  // for compact holes without a trial
// Smallest kind of holes to be tried by itself, as a fraction of all filled samples.
constexpr double least_tried_share = 0.1;
constexpr std::size_t fill_bytes_per_sample = 40;
// Bytes per sample of a hole, times the binary logarithm of their number: the fill-in of nested
// dissection grows with it. Measured for squares of 1e3 to 1e6 samples: 102 to 115, with smoothness
// 178 to 200; under bounds up to 2.6 times as much.
constexpr double bytes_of_plate = 120, bytes_of_smooth = 210, more_under_bounds = 2.75;
constexpr double trials_share = 0.3;  // fraction of the reported progress

bool is_height(float z) { return !std::isnan(z); }

void check_numbers(std::span<const float> values, const char* name, int columns,
                   Violations& broken) {
  const auto infinite = std::ranges::find_if(values, [](float z) { return std::isinf(z); });
  const auto at = infinite - values.begin();
  broken.unless(infinite == values.end(),
                "{} in column {}, row {} is infinite; it must be finite, or NaN if unknown", name,
                at % columns, at / columns);
}

void check_fill_inputs(const GridFrame& frame, std::span<const float> heights_m,
                       std::span<const float> most_m, const FillOptions& options) {
  Violations broken("filling a DEM");
  const auto samples = std::int64_t{frame.samples.x} * frame.samples.y;
  broken.unless(frame.samples.x >= 2 && frame.samples.y >= 2,
                "samples = [{}, {}] must be at least 2 along each axis", frame.samples.x,
                frame.samples.y);
  broken.unless(samples < std::numeric_limits<std::int32_t>::max(),
                "{} samples exceed the limit of 2^31; fill parts of the DEM", samples);
  const double area_m2 = frame.step_m.x * frame.step_m.y;
  broken.unless(std::isfinite(area_m2) && area_m2 != 0,
                "step_m = [{}, {}] must be finite and not zero", frame.step_m.x, frame.step_m.y);
  broken.unless(std::ssize(heights_m) == samples, "heights_m has {} entries for {} samples",
                heights_m.size(), samples);
  broken.unless(most_m.empty() || std::ssize(most_m) == samples,
                "there are {} bounds or filled heights for {} samples; each sample needs one",
                most_m.size(), samples);
  broken.unless(!options.farthest_m || *options.farthest_m > 0, "farthest_m = {} must be positive",
                options.farthest_m.value_or(0));
  broken.unless(options.largest_share > 0 && options.largest_share <= 1,
                "largest_share = {} must be above 0 and at most 1", options.largest_share);
  const ThinPlateEnergy form = options.form.value_or(ThinPlateEnergy{});
  broken.unless(form.tension >= 0 && form.tension < 1,
                "tension = {} must be at least 0 and below 1", form.tension);
  broken.unless(form.smoothness >= 0 && form.smoothness <= 1e6, "smoothness = {} must be 0 to 1e6",
                form.smoothness);
  broken.throw_if_any();
  check_numbers(heights_m, "the height", frame.samples.x, broken);
  check_numbers(most_m, "the bound or filled height", frame.samples.x, broken);
  broken.unless(std::ranges::any_of(heights_m, is_height),
                "there are no heights to fill from: all are NaN; is the nodata value right?");
  broken.throw_if_any();
}

// Fills the holes of one raster.
class Filling {
 public:
  Filling(const GridFrame& frame, std::span<const float> heights_m, std::span<const float> most_m,
          const FillOptions& options, const RunControl& work);
  FilledHeights run();

 private:
  struct Shape {
    bool is_shadow = false, is_long = false;
    friend auto operator<=>(const Shape&, const Shape&) = default;
  };
  struct Kind {
    Shape shape;
    int first, end;  // octaves of the largest distance to data
    std::vector<TriedHole> holes;
  };
  ThinPlateRaster raster_now() const {
    return {frame_.samples, frame_.step_m, heights_m_, sorted_.numbers};
  }
  int octave_of(const RasterHole& hole) const;
  Shape shape_of(std::size_t hole) const;
  void find_sights();
  std::vector<Kind> kinds() const;
  void check_memory(std::span<const std::vector<std::uint32_t>> sets) const;
  void try_kinds();
  void borrow_models();
  void fill(const std::vector<std::uint32_t>& set);
  std::size_t trial_of(const std::vector<std::uint32_t>& set) const;
  const std::optional<FillErrorModel>& model_of(const RasterHole& hole,
                                                std::size_t filled_by) const;
  double sd_at(std::uint32_t sample, const std::optional<FillErrorModel>& model) const;

  GridFrame frame_;
  double cell_m_;
  std::span<const float> heights_m_, most_m_;
  FillOptions options_;
  const RunControl& work_;
  FilledHeights result_;
  SortedHoles sorted_;
  std::vector<std::optional<GrazingSight>> sights_;    // of each hole; only for shadows
  std::vector<std::optional<FillErrorModel>> models_;  // error model of each trial
  std::optional<GroundRoughness> roughness_;
};

Filling::Filling(const GridFrame& frame, std::span<const float> heights_m,
                 std::span<const float> most_m, const FillOptions& options, const RunControl& work)
    : frame_(frame),
      cell_m_(std::sqrt(std::abs(frame.step_m.x * frame.step_m.y))),
      heights_m_(heights_m),
      most_m_(most_m),
      options_(options),
      work_(work) {
  const auto has_data = marks_of(heights_m, is_height);
  result_.heights_m.assign(heights_m.begin(), heights_m.end());
  result_.sd_m.assign(heights_m.size(), std::numeric_limits<float>::quiet_NaN());
  result_.to_data_m = data_distance_m(frame.samples, frame.step_m, has_data);
  sorted_ = sort_holes(frame, has_data, result_.to_data_m, options);
}

int Filling::octave_of(const RasterHole& hole) const {
  return static_cast<int>(math::log2(std::clamp(hole.farthest_m / cell_m_, 1.0, 1e9)));
}

Filling::Shape Filling::shape_of(std::size_t hole) const {
  const RasterHole& of = sorted_.holes[hole];
  const double cells = of.farthest_m / cell_m_;
  return {sights_[hole].has_value(), static_cast<double>(of.samples) > long_shape * cells * cells};
}

void Filling::find_sights() {
  sights_.resize(sorted_.holes.size());
  if (most_m_.empty()) return;
  const ThinPlateRaster raster = raster_now();
  tbb::parallel_for(std::size_t{0}, sights_.size(), [&](std::size_t i) {
    if (sorted_.holes[i].fate == HoleFate::Filled)
      sights_[i] = sight_over(raster, most_m_, sorted_.samples[i]);
  });
}

// Merges octaves until each kind has a sufficient fraction of all samples for a trial.
std::vector<Filling::Kind> Filling::kinds() const {
  std::map<std::pair<Shape, int>, std::vector<TriedHole>> octaves;
  std::size_t all = 0;
  for (std::size_t i = 0; i < sorted_.holes.size(); ++i) {
    const RasterHole& hole = sorted_.holes[i];
    if (hole.fate != HoleFate::Filled) continue;
    octaves[{shape_of(i), octave_of(hole)}].push_back(
        {sorted_.samples[i], hole.farthest_m / cell_m_, sights_[i]});
    all += hole.samples;
  }
  std::vector<Kind> kinds;
  std::size_t in_last = all;
  for (const auto& [octave, holes] : octaves) {
    const bool goes_on =
        !kinds.empty() && kinds.back().shape == octave.first &&
        static_cast<double>(in_last) < least_tried_share * static_cast<double>(all);
    if (!goes_on) {
      kinds.push_back({octave.first, octave.second, octave.second + 1, {}});
      in_last = 0;
    }
    kinds.back().end = octave.second + 1;
    for (const TriedHole& hole : holes) {
      kinds.back().holes.push_back(hole);
      in_last += hole.samples.size();
    }
  }
  return kinds;
}

void Filling::check_memory(std::span<const std::vector<std::uint32_t>> sets) const {
  std::size_t all = 0, largest = 0;
  for (const auto& set : sets) {
    all += set.size();
    largest = std::max(largest, set.size());
  }
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const bool may_be_smooth = !options_.form || options_.form->smoothness > 0;
  const double each = (may_be_smooth ? bytes_of_smooth : bytes_of_plate) *
                      (most_m_.empty() ? 1 : more_under_bounds) *
                      math::log2(static_cast<double>(std::max<std::size_t>(largest, 2)));
  const std::size_t bytes =
      fill_bytes_per_sample * heights_m_.size() +
      static_cast<std::size_t>(each * static_cast<double>(std::min(all, threads * largest)));
  if (bytes <= work_.most_bytes) return;
  throw Error(
      "filling a DEM of {} x {} samples may take {:.0f} MB, more than the {:.0f} MB allowed: its "
      "largest hole has {} samples; lower the limits on holes, or fill parts of the DEM",
      frame_.samples.x, frame_.samples.y, static_cast<double>(bytes) / 1e6,
      static_cast<double>(work_.most_bytes) / 1e6, largest);
}

void Filling::try_kinds() {
  const std::vector<Kind> all = kinds();
  const ThinPlateRaster raster = raster_now();
  for (const Kind& kind : all) {
    const FillTrial trial = try_filling(raster, kind.holes, options_.form, roughness_->usual_m());
    const ThinPlateEnergy untried{kind.shape.is_shadow || kind.shape.is_long ? 0 : usual_tension,
                                  0};
    result_.trials.push_back({kind.shape.is_shadow, kind.shape.is_long, math::exp2(kind.first),
                              math::exp2(kind.end),
                              options_.form.value_or(trial.form.value_or(untried)), trial.samples,
                              trial.cover.within_1sd, trial.cover.within_2sd, trial.widened_by});
    models_.push_back(trial.model);
    work_.report(trials_share * static_cast<double>(models_.size()) /
                 static_cast<double>(all.size()));
  }
  borrow_models();
  for (std::size_t i = 0; i < sorted_.holes.size(); ++i) {
    RasterHole& hole = sorted_.holes[i];
    if (hole.fate != HoleFate::Filled) continue;
    const auto is_its = [&](const Kind& kind) {
      return kind.shape == shape_of(i) && kind.first <= octave_of(hole) &&
             octave_of(hole) < kind.end;
    };
    hole.trial = static_cast<std::size_t>(std::ranges::find_if(all, is_its) - all.begin());
  }
}

// Gives kinds without an error model that of the most similar kind, the nearest in their order.
void Filling::borrow_models() {
  const auto own = models_;
  for (std::size_t i = 0; i < own.size(); ++i) {
    for (std::size_t apart = 1; !models_[i] && apart < own.size(); ++apart) {
      if (i + apart < own.size() && own[i + apart]) models_[i] = own[i + apart];
      if (i >= apart && own[i - apart]) models_[i] = own[i - apart];
    }
  }
}

// Returns the trial of the largest hole of a set, whose form is used for the whole set.
std::size_t Filling::trial_of(const std::vector<std::uint32_t>& set) const {
  const RasterHole* largest = nullptr;
  for (const std::uint32_t sample : set) {
    const RasterHole& hole = sorted_.holes[static_cast<std::size_t>(sorted_.numbers[sample])];
    if (largest == nullptr || hole.samples > largest->samples) largest = &hole;
  }
  return largest->trial;
}

double Filling::sd_at(std::uint32_t sample, const std::optional<FillErrorModel>& model) const {
  if (!model) return std::numeric_limits<double>::quiet_NaN();
  const double cells = result_.to_data_m[sample] / cell_m_;
  const glm::ivec2 at = raster_now().place(sample);
  return model->sd_m(cells, roughness_->at_m(at, roughness_reach(cells), roughness_->usual_m()));
}

// Returns the error model of the hole's own kind if that uses the form by which the hole was
// filled, else that of the kind for which the form was chosen.
const std::optional<FillErrorModel>& Filling::model_of(const RasterHole& hole,
                                                       std::size_t filled_by) const {
  const auto& trials = result_.trials;
  return models_[trials[hole.trial].form == trials[filled_by].form ? hole.trial : filled_by];
}

void Filling::fill(const std::vector<std::uint32_t>& set) {
  const std::size_t filled_by = trial_of(set);
  const ThinPlateEnergy form = result_.trials[filled_by].form;
  std::vector<std::size_t> holes;  // hole of each sample
  std::int32_t number = 0;
  for (const std::uint32_t sample : set)
    holes.push_back(static_cast<std::size_t>(std::exchange(sorted_.numbers[sample], number++)));
  ThinPlateSystem system(raster_now(), set);
  BoundedThinPlate plate;
  if (most_m_.empty()) {
    plate.heights_m = system.solve(form);
  } else {
    std::vector<double> most_m;
    for (const std::uint32_t sample : set) most_m.push_back(most_m_[sample]);
    plate = system.solve_below(form, most_m);
  }
  for (std::size_t i = 0; i < set.size(); ++i) {
    const std::uint32_t sample = set[i];
    RasterHole& hole = sorted_.holes[holes[i]];
    hole.form = form;
    hole.is_least = plate.is_best;
    result_.sd_m[sample] = static_cast<float>(sd_at(sample, model_of(hole, filled_by)));
    float height_m = static_cast<float>(plate.heights_m[i]);
    if (!most_m_.empty() && plate.heights_m[i] >= most_m_[sample]) {
      height_m = most_m_[sample];
      ++hole.at_bound;
    }
    result_.heights_m[sample] = height_m;
  }
}

FilledHeights Filling::run() {
  const auto is_wanted = marks_of(sorted_.numbers, [](std::int32_t number) { return number >= 0; });
  const auto sets = coupled_samples(frame_.samples, is_wanted);
  check_memory(sets);
  const auto all = static_cast<double>(std::ranges::count(is_wanted, std::uint8_t{1}));
  roughness_.emplace(frame_.samples, heights_m_);
  find_sights();
  try_kinds();
  std::mutex one_at_a_time;
  tbb::parallel_for(std::size_t{0}, sets.size(), [&](std::size_t i) {
    fill(sets[i]);
    const std::lock_guard lock(one_at_a_time);
    result_.filled += sets[i].size();
    work_.report(trials_share + (1 - trials_share) * static_cast<double>(result_.filled) / all);
  });
  result_.holes = std::move(sorted_.holes);
  return std::move(result_);
}

}  // namespace

FilledHeights fill_dem(const GridFrame& frame, std::span<const float> heights_m,
                       std::span<const float> most_m, const FillOptions& options,
                       const RunControl& work) {
  check_fill_inputs(frame, heights_m, most_m, options);
  return Filling(frame, heights_m, most_m, options, work).run();
}

FilledHeights take_filling(const GridFrame& frame, std::span<const float> heights_m,
                           std::span<const float> filled_m, const FillOptions& options) {
  check_fill_inputs(frame, heights_m, filled_m, options);
  FilledHeights result;
  result.heights_m.assign(heights_m.begin(), heights_m.end());
  result.sd_m.assign(heights_m.size(), std::numeric_limits<float>::quiet_NaN());
  const auto has_data = marks_of(heights_m, is_height);
  result.to_data_m = data_distance_m(frame.samples, frame.step_m, has_data);
  SortedHoles sorted = sort_holes(frame, has_data, result.to_data_m, options);
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    if (sorted.numbers[i] < 0) continue;
    RasterHole& hole = sorted.holes[static_cast<std::size_t>(sorted.numbers[i])];
    result.heights_m[i] = filled_m[i];
    if (std::isnan(filled_m[i])) {
      hole.fate = HoleFate::Partly;
    } else {
      ++result.filled;
    }
  }
  result.holes = std::move(sorted.holes);
  return result;
}

}  // namespace groundray
