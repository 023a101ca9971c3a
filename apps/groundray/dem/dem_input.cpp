#include "apps/groundray/dem/dem_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <span>
#include <utility>

#include "apps/groundray/progress_stage.h"
#include "core/error.h"

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

}  // namespace

void check_count(std::size_t points) {
  if (points == 0)
    throw Error("no scan has a return and no stereo pair has a match: a DEM cannot be computed");
  if (points < 3)
    throw Error("there {} only {} point{}: a DEM needs three or more", points == 1 ? "is" : "are",
                points, points == 1 ? "" : "s");
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
                   const std::vector<RecordedPair>& pairs)
    : request_(request), files_(files), scans_(files.scans.size()) {
  for (std::size_t i = 0; i < scans_.size(); ++i) scans_[i].name = files.scans[i].name;
  match(pairs);
}

void DemInput::match(const std::vector<RecordedPair>& recorded) {
  const auto images = image_pairs(recorded, request_.stereo.frames, notes_);
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
  Stage stage("matching");
  for (std::size_t i = 0; i < images.size(); ++i) {
    stage.update(static_cast<double>(i) / static_cast<double>(images.size()));
    const auto group = static_cast<std::uint32_t>(files_.scans.size() + i);
    pairs_.push_back(or_lidars_alone(request_.pairs, files_, [&] {
      return add_stereo_points(images[i], request_.stereo, request_.noise, group, stereo_);
    }));
  }
  stage.update(1);
}

PointNoise DemInput::noise_of(const ScanFile& scan) {
  PointNoise noise = request_.noise;
  if (noise.divergence_rad || !is_dataset(request_)) return noise;
  const std::string sensor = scan.name.substr(0, scan.name.rfind('/'));
  const auto known = divergences_rad_.find(sensor);
  noise.divergence_rad =
      known != divergences_rad_.end()
          ? known->second
          : divergences_rad_
                .emplace(sensor, calibrated_divergence_rad(request_.choice.inputs[0], scan))
                .first->second;
  return noise;
}

LidarPoints DemInput::points_of(std::size_t scan) {
  const ScanFile& file = files_.scans.at(scan);
  return {files_, file, request_.taking, noise_of(file), static_cast<std::uint32_t>(scan)};
}

bool DemInput::next(MeasuredPoints& block) {
  if (next_ == 0) {
    ++next_;
    block = stereo_;
    return true;
  }
  for (; next_ <= files_.scans.size(); ++next_) {
    stop_if_interrupted();
    if (!reading_) reading_.emplace(points_of(next_ - 1));
    LidarBlock points;
    const bool is_more = reading_->next(points);
    if (is_more) {
      block = std::move(points.points);
      return true;
    }
    scans_[next_ - 1] = reading_->tally();
    reading_.reset();
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

void DemInput::rewind() noexcept {
  next_ = 0;
  reading_.reset();
}

Area DemInput::extent() {
  rewind();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Area area{glm::dvec2(infinity), glm::dvec2(-infinity)};
  std::size_t count = 0;
  Stage stage("reading");
  for (MeasuredPoints block; next(block);) {
    area = around(block.p_m, area);
    count += block.size();
    stage.update(static_cast<double>(std::min(next_, files_.scans.size())) /
                 static_cast<double>(files_.scans.size() + 1));
  }
  rewind();
  check_count(count);
  return area;
}

}  // namespace groundray
