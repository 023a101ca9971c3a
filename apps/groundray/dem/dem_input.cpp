#include "apps/groundray/dem/dem_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "apps/scene/interruption.h"
#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

bool is_dataset(const DemRequest& request) { return fs::is_directory(request.choice.inputs.at(0)); }

Area around(std::span<const glm::dvec3> points_m, Area area) {
  for (const glm::dvec3& p : points_m) {
    area.low_m = glm::min(area.low_m, glm::dvec2(p));
    area.high_m = glm::max(area.high_m, glm::dvec2(p));
  }
  return area;
}

// Runs `step`; its error suggests to use lidars alone if scans exist and no pairs were named.
template <typename Step>
auto or_lidars_alone(const PairChoice& choice, const ScanFiles& files, const Step& step) {
  try {
    return step();
  } catch (const Error& fault) {
    if (files.scans.empty() || !choice.names.empty()) throw;
    throw Error("{}; --no-stereo uses only lidars", fault.what());
  }
}

// Merges notes that differ only by the scan's name: keeps the first, with the number of others.
std::vector<std::string> notes_of_scans(const ScanFiles& files,
                                        const std::vector<PointTally>& scans) {
  std::vector<std::string> notes, nameless;
  std::vector<std::size_t> more;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::string name = files.scans[i].file.string();
    for (const std::string& note : scans[i].notes) {
      const std::size_t at = note.find(name);
      const std::string rest =
          at == std::string::npos ? note : note.substr(0, at) + note.substr(at + name.size());
      const auto known = std::ranges::find(nameless, rest);
      if (known != nameless.end()) {
        ++more[static_cast<std::size_t>(known - nameless.begin())];
        continue;
      }
      notes.push_back(note);
      nameless.push_back(rest);
      more.push_back(0);
    }
  }
  for (std::size_t i = 0; i < notes.size(); ++i)
    if (more[i] > 0) notes[i] += fmt::format(" (also for {} more scans)", more[i]);
  return notes;
}

// Returns the divergence of a dataset's lidar according to its calibration, rad: full angle between
// the 1/e^2 points, as the root mean square of both axes, widened by the jitter of the beams.
// Without light, only the jitter counts: points lie where the axes of the beams hit. Nothing if
// there is no calibration file.
std::optional<double> calibrated_divergence_rad(const fs::path& dataset,
                                                const std::string& sensor) {
  const fs::path path = dataset / "calibration" / (sensor + ".yaml");
  if (!fs::is_regular_file(path)) return std::nullopt;
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  std::string text;
  root.read_text("lidar_file", yaml::Need::Required, text);
  root.close_partly();
  faults.throw_if_any();
  const LidarSpec lidar = parse_lidar(text, path);
  double width_rad = 0;
  if (lidar.light) {
    width_rad = glm::length(lidar.beam.divergence_rad) / std::numbers::sqrt2;
    const bool is_half_maximum = lidar.beam.profile == BeamSpec::Profile::Gaussian &&
                                 lidar.beam.width == BeamSpec::Width::FullWidthHalfMaximum;
    // exp(-2 x^2) is 1/2 at x = sqrt(ln 2 / 2).
    if (is_half_maximum) width_rad /= std::sqrt(std::numbers::ln2 / 2);
  }
  return math::hypot(width_rad, 4 * lidar.angular_jitter_rad);
}

// Checks the poses and the distances of a scan's points.
void check_points(const ScanFiles& files, const ScanFile& scan, const MeasurementNoise& noise,
                  const PointInput& input) {
  if (scan.path)
    check_gap(scan.name, files.paths[*scan.path], input.begin, input.end, noise.longest_pose_gap_s);
  if (files.are_posed || noise.points.beams == BeamOrigin::Above) return;
  constexpr double far_m = 10'000;
  for (std::size_t i = 0; i < input.points_m.size(); ++i) {
    const double range_m = glm::distance(input.points_m[i], input.origins_m[i]);
    if (range_m <= far_m) continue;
    throw Error(
        "{}: a point is {:.4g} km from the sensor, which without poses is at the origin: are these "
        "map coordinates? Add --airborne or --poses",
        scan.file.string(), range_m / 1000);
  }
}

void count(const PointInput& input, PointTally& tally) {
  tally.rows += input.rows;
  tally.points += input.points_m.size();
  tally.is_noiseless =
      tally.is_noiseless && std::ranges::all_of(input.sd_m, [](float sd_m) { return sd_m == 0; });
  for (const std::string& note : input.notes) {
    if (std::ranges::find(tally.notes, note) == tally.notes.end()) tally.notes.push_back(note);
  }
}

}  // namespace

void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end, double longest_s) {
  const auto& samples = path.samples();
  const auto s = [](std::chrono::nanoseconds at) { return 1e-9 * static_cast<double>(at.count()); };
  auto after = std::ranges::upper_bound(samples, begin, {}, &Trajectory::Sample::time);
  if (after == samples.begin() && after != samples.end()) ++after;
  for (; after != samples.end(); ++after) {
    const auto from = std::prev(after)->time, to = after->time;
    if (from > begin && from >= end) return;
    if (s(to - from) <= longest_s) continue;
    throw Error(
        "{}: the poses have a gap of {:.6g} s there, from {:.9g} to {:.9g} s, more than {:g} s: "
        "exclude it (--frames, --stereo-frames), or permit longer gaps by --pose-gap-s",
        name, s(to - from), s(from), s(to), longest_s);
  }
}

std::vector<RecordedPair> find_pairs(const DemRequest& request, const ScanFiles& files) {
  const PairChoice& choice = request.pairs;
  if (!choice.are_any) return {};
  if (!is_dataset(request)) {
    if (!choice.names.empty())
      throw Error("--stereo: only a dataset has stereo pairs: give its folder");
    return {};
  }
  const fs::path& dataset = request.choice.inputs[0];
  auto pairs =
      or_lidars_alone(choice, files, [&] { return read_stereo_pairs(dataset, choice.names); });
  if (pairs.empty() && files.scans.empty())
    throw Error(
        "{}: without lidars a stereo pair is needed, but the dataset lists none: define one from "
        "two cameras by --stereo LEFT,RIGHT",
        dataset.string());
  return pairs;
}

DemInput::DemInput(const DemRequest& request, const ScanFiles& files,
                   const std::vector<RecordedPair>& pairs, StageProgress& progress)
    : request_(request), files_(files), progress_(progress), scans_(files.scans.size()) {
  for (std::size_t i = 0; i < scans_.size(); ++i) scans_[i].name = files.scans[i].name;
  match(pairs);
}

void DemInput::match(const std::vector<RecordedPair>& recorded) {
  const auto images = image_pairs(recorded, request_.pairs.frames, notes_);
  if (images.empty()) {
    if (!request_.pairs.names.empty() || files_.scans.empty())
      throw Error(
          "{}: the stereo pairs have no simultaneous images among those requested "
          "(--stereo-frames){}",
          request_.choice.inputs.at(0).string(),
          notes_.empty() ? "" : fmt::format("; {}", fmt::join(notes_, "; ")));
    return;
  }
  if (request_.choice.poses)
    notes_.emplace_back("--poses applies to the lidar: cameras keep the poses of the dataset");
  const bool moves = std::ranges::any_of(
      recorded, [](const RecordedPair& pair) { return pair.cameras[0].row_s > 0; });
  if (moves)
    notes_.emplace_back(
        "rolling shutters: all rows are treated as exposed at the time of the middle row");
  for (std::size_t i = 0; i < images.size(); ++i) {
    progress_.update("matching", static_cast<double>(i) / static_cast<double>(images.size()));
    const auto group = static_cast<std::uint32_t>(files_.scans.size() + i);
    pairs_.push_back(or_lidars_alone(request_.pairs, files_, [&] {
      return add_stereo_points(images[i], request_.stereo, request_.noise, group, stereo_);
    }));
  }
  progress_.update("matching", 1);
}

MeasurementNoise DemInput::noise_of(const ScanFile& scan) {
  MeasurementNoise noise = request_.noise;
  if (noise.points.divergence_rad || !is_dataset(request_)) return noise;
  const std::string sensor = scan.name.substr(0, scan.name.rfind('/'));
  auto known = divergences_rad_.find(sensor);
  if (known == divergences_rad_.end())
    known = divergences_rad_
                .emplace(sensor, calibrated_divergence_rad(request_.choice.inputs[0], sensor))
                .first;
  noise.points.divergence_rad = known->second;
  return noise;
}

bool DemInput::next(LidarBlock& block) {
  if (next_ == 0) {
    ++next_;
    block = {.points = stereo_};
    return true;
  }
  for (; next_ <= files_.scans.size(); ++next_) {
    stop_if_interrupted();
    const ScanFile& scan = files_.scans[next_ - 1];
    PointTally& tally = scans_[next_ - 1];
    if (!reader_) {
      reader_.emplace(files_, scan, request_.taking);
      noise_ = noise_of(scan);
      tally = {.name = scan.name, .is_noiseless = true};
    }
    PointInput input;
    if (!reader_->next(input)) {
      reader_.reset();
      continue;
    }
    check_points(files_, scan, noise_, input);
    count(input, tally);
    block = {.share = static_cast<double>(next_) / static_cast<double>(files_.scans.size())};
    const auto group = static_cast<std::uint32_t>(next_ - 1);
    for (std::size_t i = 0; i < input.points_m.size(); ++i)
      append({input.points_m[i], input.origins_m[i], input.sd_m[i]}, group, noise_.points,
             block.points);
    block.origins_m = std::move(input.origins_m);
    return true;
  }
  return false;
}

std::vector<std::string> DemInput::notes() const {
  std::vector<std::string> notes = notes_;
  for (std::string& note : notes_of_scans(files_, scans_)) notes.push_back(std::move(note));
  const auto noiseless = std::ranges::count_if(
      scans_, [](const PointTally& scan) { return scan.is_noiseless && scan.points > 0; });
  if (noiseless > 0)
    notes.push_back(
        fmt::format("{} of {} scans have no standard deviation of range, so those of heights are "
                    "too small: give it by --range-sd-m",
                    noiseless, scans_.size()));
  return notes;
}

void DemInput::go_to(std::size_t block) noexcept {
  next_ = block;
  reader_.reset();
}

void DemInput::check_count(std::size_t points) const {
  if (points >= 3) return;
  const std::string where =
      scans_.empty() ? "" : first_and_count(scans_.front().name, scans_.size()) + ": ";
  if (points == 0) {
    throw Error("{}no scan has a return and no stereo pair has a match: a DEM cannot be computed",
                where);
  }
  throw Error("{}there {} only {} point{}: a DEM needs three or more", where,
              points == 1 ? "is" : "are", points, points == 1 ? "" : "s");
}

Area DemInput::extent() {
  rewind();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Area area{glm::dvec2(infinity), glm::dvec2(-infinity)};
  std::size_t count = 0;
  for (LidarBlock block; next(block);) {
    area = around(block.points.p_m, area);
    count += block.points.size();
    progress_.update("reading", static_cast<double>(std::min(next_, files_.scans.size())) /
                                    static_cast<double>(files_.scans.size() + 1));
  }
  rewind();
  check_count(count);
  return area;
}

}  // namespace groundray
