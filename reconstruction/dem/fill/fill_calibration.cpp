#include "reconstruction/dem/fill/fill_calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/math.h"
#include "reconstruction/dem/dem_layers.h"
#include "reconstruction/dem/fill/sorted_holes.h"

namespace groundray {
namespace {

constexpr std::size_t enough_samples = 7000, enough_pieces = 300, fewest_pieces = 4,
                      fewest_for_forms = 12, fewest_shadows = 30;
constexpr std::uint32_t most_attempts = 600, batch = 4;
constexpr std::size_t telling_samples = 1200;  // after which only promising forms are tried
constexpr double doubt = 2;          // gain over a thin plate that a form needs, in standard errors
constexpr double least_gain = 0.02;  // and as a fraction of its squared errors

constexpr double doubt_in_shadow = 1;
// Ground in its own shadow falls off behind crests, by more than a thin plate does.
constexpr ThinPlateEnergy usual_in_shadow{0, 5};

// Ordered from the form for the roughest ground to that for the smoothest. Includes the thin plate.
const std::vector<ThinPlateEnergy> all_forms{{0.2, 0}, {0.05, 0}, {0, 0}, {0, 0.25},
                                             {0, 1},   {0, 5},    {0, 50}};

// Errors of one piece.
struct PieceErrors {
  std::vector<std::vector<float>> errors_m;  // by form and hidden sample
  std::vector<float> distances_cells, roughness_m;
};

bool is_to_fill(std::int32_t number) { return number >= 0; }

// Excludes missing samples that are not connected to any known one. Returns whether all hidden
// samples remain.
bool drop_loose(HoldoutMask& piece) {
  const auto is_open = marks_of(piece.numbers, is_to_fill);
  for (const auto& set : linked_samples(piece.size, is_open)) {
    if (has_known_neighbour(piece.size, piece.numbers, set)) continue;
    for (const std::uint32_t sample : set) piece.numbers[sample] = absent_sample;
  }
  return std::ranges::all_of(piece.hidden,
                             [&](std::uint32_t sample) { return piece.numbers[sample] >= 0; });
}

// Returns the bound of each sample of a set, NaN for none; empty if the piece has no bounds.
std::vector<double> upper_bounds_of(const HoldoutMask& piece, const std::vector<std::uint32_t>& set,
                                    const std::vector<std::int32_t>& order) {
  std::vector<double> most_m;
  if (piece.most_m.empty()) return most_m;
  for (const std::uint32_t sample : set) {
    const std::int32_t at = order[sample];
    most_m.push_back(at < 0 ? std::numeric_limits<double>::quiet_NaN()
                            : double{piece.most_m[static_cast<std::size_t>(at)]});
  }
  return most_m;
}

void fill_piece(HoldoutMask& piece, std::span<const ThinPlateEnergy> forms, PieceErrors& found) {
  const auto is_open = marks_of(piece.numbers, is_to_fill);
  // Index in piece.hidden; -1 for others.
  std::vector<std::int32_t> order(piece.numbers.size(), -1);
  for (std::size_t i = 0; i < piece.hidden.size(); ++i)
    order[piece.hidden[i]] = static_cast<std::int32_t>(i);
  found.errors_m.assign(forms.size(), std::vector<float>(piece.hidden.size()));
  for (const auto& set : coupled_samples(piece.size, is_open)) {
    if (std::ranges::all_of(set, [&](std::uint32_t sample) { return order[sample] < 0; })) continue;
    std::int32_t number = 0;
    for (const std::uint32_t sample : set) piece.numbers[sample] = number++;
    ThinPlateSystem system(piece.raster(), set);
    const std::vector<double> most_m = upper_bounds_of(piece, set, order);
    for (std::size_t form = 0; form < forms.size(); ++form) {
      const std::vector<double> heights_m = most_m.empty()
                                                ? system.solve(forms[form])
                                                : system.solve_below(forms[form], most_m).heights_m;
      for (std::size_t i = 0; i < set.size(); ++i) {
        const std::int32_t at = order[set[i]];
        if (at < 0) continue;
        const auto hidden = static_cast<std::size_t>(at);
        found.errors_m[form][hidden] =
            static_cast<float>(heights_m[i] - double{piece.truth_m[hidden]});
      }
    }
  }
}

// Determines each hidden sample's distance to data, and the roughness there.
void describe_piece(const HoldoutMask& piece, double usual_roughness_m, PieceErrors& found) {
  const auto has_data = marks_of(piece.heights_m, [](float z) { return !std::isnan(z); });
  const double cell_m = std::sqrt(std::abs(piece.step_m.x * piece.step_m.y));
  const auto distances_m = data_distance_m(piece.size, piece.step_m, has_data);
  const GroundRoughness roughness(piece.size, piece.heights_m);
  for (const std::uint32_t sample : piece.hidden) {
    const double cells = distances_m[sample] / cell_m;
    const glm::ivec2 at = piece.raster().place(sample);
    found.distances_cells.push_back(static_cast<float>(cells));
    found.roughness_m.push_back(
        static_cast<float>(roughness.at_m(at, roughness_reach(cells), usual_roughness_m)));
  }
}

double squares_of(const std::vector<float>& errors_m) {
  double sum = 0;
  for (const float error_m : errors_m) sum += double{error_m} * error_m;
  return sum;
}

// Gain of a form over another in squared errors, piece by piece.
struct Gain {
  double mean_log = 0;   // of the ratio of squared errors; large pieces have more weight
  double chance = 0;     // standard error of the mean
  bool is_less = false;  // true if the total decreases, by more than half its standard error
};

Gain gain_of(std::span<const PieceErrors> pieces, std::size_t form, std::size_t on) {
  constexpr double most_weight = 50, least_m2 = 1e-18;
  double weights = 0, sum = 0, squares = 0, less = 0, less_squares = 0;
  for (const PieceErrors& piece : pieces) {
    const double own = squares_of(piece.errors_m[form]), other = squares_of(piece.errors_m[on]);
    const double weight = std::min(static_cast<double>(piece.distances_cells.size()), most_weight);
    const double log_ratio = weight * math::log((other + least_m2) / (own + least_m2));
    weights += weight;
    sum += log_ratio;
    squares += log_ratio * log_ratio;
    less += other - own;
    less_squares += (other - own) * (other - own);
  }
  return {sum / weights, std::sqrt(squares) / weights, less > std::sqrt(less_squares) / 2};
}

// Gain that a form needs to replace the usual one.
struct Demand {
  ThinPlateEnergy usual;
  double sds = 0;    // in standard errors
  double share = 0;  // as a fraction of squared errors
};

// Returns the index of the form with the largest gain, or of the usual form if no gain is
// sufficient.
std::size_t best_form(std::span<const PieceErrors> pieces, std::span<const ThinPlateEnergy> forms,
                      const Demand& demand) {
  const auto usual_at = std::ranges::find(forms, demand.usual);
  if (usual_at == forms.end()) return 0;
  const auto usual = static_cast<std::size_t>(usual_at - forms.begin());
  std::size_t best = usual;
  double most = demand.share;
  for (std::size_t form = 0; form < forms.size(); ++form) {
    const Gain gain = gain_of(pieces, form, usual);
    if (!gain.is_less || gain.mean_log <= std::max(most, demand.sds * gain.chance)) continue;
    most = gain.mean_log;
    best = form;
  }
  return best;
}

// Returns the forms that are worth more trials: the best so far, its neighbours and the usual one.
std::vector<ThinPlateEnergy> promising(std::span<const PieceErrors> pieces,
                                       std::span<const ThinPlateEnergy> forms,
                                       const ThinPlateEnergy& usual) {
  const std::size_t best = best_form(pieces, forms, {usual});
  std::vector<ThinPlateEnergy> kept;
  for (std::size_t form = 0; form < forms.size(); ++form) {
    const bool is_near = form + 1 >= best && form <= best + 1;
    if (is_near || forms[form] == usual) kept.push_back(forms[form]);
  }
  return kept;
}

// Removes the errors of forms that are not kept.
void keep(std::vector<PieceErrors>& pieces, std::span<const ThinPlateEnergy> forms,
          std::span<const ThinPlateEnergy> kept) {
  for (PieceErrors& piece : pieces) {
    std::vector<std::vector<float>> errors_m;
    for (std::size_t form = 0; form < forms.size(); ++form) {
      if (std::ranges::find(kept, forms[form]) != kept.end())
        errors_m.push_back(std::move(piece.errors_m[form]));
    }
    piece.errors_m = std::move(errors_m);
  }
}

// Tries pieces until there are enough of them; reduces `forms` on the way.
std::vector<PieceErrors> try_pieces(const HoldoutMaskMaker& maker,
                                    std::vector<ThinPlateEnergy>& forms,
                                    const ThinPlateEnergy& usual, std::size_t fewest,
                                    double usual_roughness_m) {
  std::vector<PieceErrors> all;
  std::size_t samples = 0;
  for (std::uint32_t first = 0; first < most_attempts; first += batch) {
    std::vector<PieceErrors> tried(batch);
    tbb::parallel_for(std::uint32_t{0}, batch, [&](std::uint32_t i) {
      std::optional<HoldoutMask> piece = maker.make(first + i);
      if (!piece || !drop_loose(*piece)) return;
      describe_piece(*piece, usual_roughness_m, tried[i]);
      fill_piece(*piece, forms, tried[i]);
    });
    for (PieceErrors& found : tried) {
      if (found.errors_m.empty()) continue;
      samples += found.distances_cells.size();
      all.push_back(std::move(found));
    }
    if (all.size() >= enough_pieces || (all.size() >= fewest && samples >= enough_samples)) break;
    if (forms.size() == all_forms.size() && all.size() >= fewest_pieces &&
        samples >= telling_samples) {
      const std::vector<ThinPlateEnergy> kept = promising(all, forms, usual);
      keep(all, forms, kept);
      forms = kept;
    }
  }
  return all;
}

// Fits the error model, and tests the models from each half of the pieces on the other half.
void judge(std::span<const FillError> errors, FillTrial& trial) {
  trial.model = fit_error_model(errors);
  std::array<std::vector<FillError>, 2> halves;
  for (const FillError& error : errors) halves[error.trial % 2].push_back(error);
  const std::array models{fit_error_model(halves[0]), fit_error_model(halves[1])};
  if (!trial.model || !models[0] || !models[1]) return;
  double all = 0;
  trial.cover = {0, 0, 0};
  for (const std::size_t half : {0u, 1u}) {
    const FillCover cover = cover_of(halves[half], *models[1 - half]);
    const auto count = static_cast<double>(halves[half].size());
    trial.cover.within_1sd += count * cover.within_1sd;
    trial.cover.within_2sd += count * cover.within_2sd;
    trial.cover.rms_sds += count * cover.rms_sds * cover.rms_sds;
    all += count;
  }
  trial.cover = {trial.cover.within_1sd / all, trial.cover.within_2sd / all,
                 std::sqrt(trial.cover.rms_sds / all)};
  trial.widened_by = std::max(trial.cover.rms_sds, 1.0);
  trial.model->factors[0] += 2 * math::log(trial.widened_by);
}

}  // namespace

FillTrial try_filling(const ThinPlateRaster& raster, std::span<const TriedHole> holes,
                      const std::optional<ThinPlateEnergy>& form, double usual_roughness_m) {
  std::vector<ThinPlateEnergy> forms = all_forms;
  if (form) forms = {*form};
  const bool is_shadow = holes.front().sight.has_value();
  const Demand demand = is_shadow ? Demand{usual_in_shadow, doubt_in_shadow, 0}
                                  : Demand{ThinPlateEnergy{}, doubt, least_gain};
  const std::vector<PieceErrors> pieces =
      try_pieces(HoldoutMaskMaker(raster, holes), forms, demand.usual,
                 is_shadow ? fewest_shadows : fewest_for_forms, usual_roughness_m);
  FillTrial trial;
  if (pieces.size() < fewest_pieces) return trial;
  const std::size_t best = best_form(pieces, forms, demand);
  trial.form = forms[best];
  std::vector<FillError> errors;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    const PieceErrors& piece = pieces[i];
    for (std::size_t k = 0; k < piece.distances_cells.size(); ++k)
      errors.push_back(
          {piece.errors_m[best][k], piece.distances_cells[k], piece.roughness_m[k], i});
  }
  trial.samples = errors.size();
  judge(errors, trial);
  return trial;
}

}  // namespace groundray
