#include <cpl_minixml.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/dem/raster_input.h"

namespace groundray {
namespace {

constexpr int most_levels = 4;
constexpr double most_sources = 1 << 20;
constexpr int most_gcps = 10'000;  // a fit may leave them out one by one
constexpr vsi_l_offset most_bytes = vsi_l_offset{64} << 20;
// Work for each sample of a VRT: sources that cover it, and samples of theirs that it is made of (a
// mosaic of 1 m in cells of 60 m has 3600). The rest allows for excerpts and previews.
constexpr double most_written = 64, most_read = 4096, rest = 1 << 28;

// Bands that are mosaics or warps of files. Others are made by expressions, Python code, raw bytes
// of any file or a decomposition of colours.
constexpr std::array permitted_classes{"VRTRasterBand", "VRTSourcedRasterBand", "VRTWarpedDataset",
                                       "VRTWarpedRasterBand"};

// Transformers of warps whose work or memory has no limit: splines through any number of points,
// arrays of positions, and sensor models above other rasters.
constexpr std::array refused_transformers{"TPSTransformer", "GeoLocTransformer", "RPCTransformer"};

using Xml = std::unique_ptr<CPLXMLNode, decltype(&CPLDestroyXMLNode)>;

Xml parse(const std::string& path) {
  VSIStatBufL state;
  if (VSIStatL(path.c_str(), &state) != 0) throw Error("the VRT {} cannot be read", path);
  if (static_cast<vsi_l_offset>(state.st_size) > most_bytes) {
    throw Error("the VRT {} has {} bytes, more than the limit of {}", path, state.st_size,
                most_bytes);
  }
  Xml xml(CPLParseXMLFile(path.c_str()), &CPLDestroyXMLNode);
  if (xml == nullptr) throw Error("the VRT {} cannot be read: {}", path, CPLGetLastErrorMsg());
  return xml;
}

// Returns the name of the source in a node of a VRT. GDAL resolves relative names by the folder of
// the VRT, after following links.
std::string source_name(const CPLXMLNode& node, const std::string& vrt) {
  std::string name = CPLGetXMLValue(&node, nullptr, "");
  if (std::strtol(CPLGetXMLValue(&node, "relativeToVRT", "0"), nullptr, 10) == 0) return name;
  std::filesystem::path folder = std::filesystem::path(vrt).parent_path();
  std::error_code is_in_archive;
  const auto real = std::filesystem::canonical(vrt, is_in_archive);
  if (!is_in_archive) folder = real.parent_path();
  return folder / name;
}

// Calls `take` with each node of the tree.
void for_each_node(const CPLXMLNode& root, const auto& take) {
  std::vector<const CPLXMLNode*> open{&root};
  while (!open.empty()) {
    const CPLXMLNode* node = open.back();
    open.pop_back();
    take(*node);
    if (node->psNext != nullptr) open.push_back(node->psNext);
    if (node->psChild != nullptr) open.push_back(node->psChild);
  }
}

// Calls `take` with a node and all below it.
void for_each_below(const CPLXMLNode& node, const auto& take) {
  take(node);
  if (node.psChild != nullptr) for_each_node(*node.psChild, take);
}

[[noreturn]] void refuse(std::string_view part, const std::string& vrt) {
  throw Error(
      "the VRT {} has a {}; only mosaics and warps of files are read, these by projections and "
      "polynomials; if you trust it, convert it:{}",
      vrt, part, command(vrt, "gdal_translate", "_converted.tif"));
}

void check_class(const CPLXMLNode& node, const std::string& vrt) {
  const std::string_view value = CPLGetXMLValue(&node, nullptr, "");
  if (std::ranges::find(permitted_classes, value) == permitted_classes.end()) refuse(value, vrt);
}

// Returns the product of the sides of a rectangle, such as SrcRect, that a source may have; that of
// the whole raster if it has none, or none that is above 0.
double area(const CPLXMLNode& source, const char* rectangle, double whole) {
  const CPLXMLNode* node = CPLGetXMLNode(&source, rectangle);
  if (node == nullptr) return whole;
  const auto size = [node](const char* key) { return CPLAtof(CPLGetXMLValue(node, key, "0")); };
  const double width = size("xSize"), height = size("ySize");
  return width > 0 && height > 0 ? width * height : whole;
}

// What reading a whole VRT takes, with all that it refers to, each as often as it is referred to.
struct Extent {
  int levels = 1;
  double sources = 0;
  double samples = 0;  // of the VRT
  double written = 0, read = 0;
};

class VrtCheck {
 public:
  Extent extent_of(const std::string& path, int level) {
    refuse_depth(path, level);
    const auto known = known_.find(path);
    if (known != known_.end()) {
      refuse_depth(path, level + known->second.levels - 1);
      return known->second;
    }
    const Xml xml = parse(path);
    Extent extent;
    const CPLXMLNode* root = CPLGetXMLNode(xml.get(), "=VRTDataset");
    if (root == nullptr) return extent;          // GDAL reads none, either
    const auto size = [root](const char* key) {  // as GDAL reads it: of "20e3", 20
      return static_cast<double>(std::strtol(CPLGetXMLValue(root, key, "0"), nullptr, 10));
    };
    extent.samples = size("rasterXSize") * size("rasterYSize");
    int gcps = 0;
    for_each_node(*xml, [&](const CPLXMLNode& node) {
      if (node.eType != CXT_Element && node.eType != CXT_Attribute) return;
      if (EQUAL(node.pszValue, "subClass")) check_class(node, path);
      if (EQUAL(node.pszValue, "GCP") && ++gcps > most_gcps)
        throw Error("the VRT {} has more than {} ground control points", path, most_gcps);
      for (const char* transformer : refused_transformers)
        if (EQUAL(node.pszValue, transformer)) refuse(fmt::format("warp by {}", transformer), path);
      if (EQUAL(node.pszValue, "KernelFilteredSource")) refuse(node.pszValue, path);
      // ROOT_PATH, for one, would let the sources of a source be other files than those checked.
      if (EQUAL(node.pszValue, "OpenOptions")) refuse("source with OpenOptions", path);
    });
    // A band is read without the others.
    Extent largest;
    for (const CPLXMLNode* child = root->psChild; child != nullptr; child = child->psNext) {
      extent.written = extent.read = 0;
      for_each_below(*child, [&](const CPLXMLNode& node) {
        for (const CPLXMLNode* part = node.psChild; part != nullptr; part = part->psNext) {
          if (EQUAL(part->pszValue, "SourceFilename") || EQUAL(part->pszValue, "SourceDataset")) {
            add(node, source_name(*part, path), path, level, extent);
          }
        }
      });
      refuse_work(path, extent);
      largest.written = std::max(largest.written, extent.written);
      largest.read = std::max(largest.read, extent.read);
    }
    extent.written = largest.written;
    extent.read = largest.read;
    return known_[path] = extent;
  }

 private:
  static void refuse_depth(const std::string& path, int level) {
    if (level <= most_levels) return;
    throw Error("the VRT {} lies {} levels deep in others, more than the limit of {}", path, level,
                most_levels);
  }

  static void refuse_work(const std::string& path, const Extent& extent) {
    const double samples = extent.samples;
    const auto refuse_more = [&](double count, double most, std::string_view what) {
      if (count <= most * samples + rest) return;  // false for NaN
      throw Error(
          "for {:.3g} samples of the VRT {}, {:.3g} samples {}, more than the limit of {} for "
          "each; "
          "do its sources overlap, or are its samples too coarse?",
          samples, path, count, what, most);
    };
    refuse_more(extent.written, most_written, "are written");
    refuse_more(extent.read, most_read, "of its sources are read");
  }

  void add(const CPLXMLNode& node, const std::string& source, const std::string& vrt, int level,
           Extent& extent) {
    std::string driver;
    try {
      checked_file(source);
      driver = checked_driver(source);
    } catch (const Error& error) {
      throw Error("the VRT {} has the source {}: {}", vrt, source, error.what());
    }
    const double written = area(node, "DstRect", extent.samples);
    const double read = area(node, "SrcRect", extent.samples);
    Extent inner{.levels = 0, .sources = 1, .samples = 1, .written = 0, .read = 1};
    if (driver == "VRT") inner = extent_of(source, level + 1);
    const double times = inner.samples > 0 ? read / inner.samples : 0;
    extent.levels = std::max(extent.levels, inner.levels + 1);
    extent.written += written + times * inner.written;
    extent.read += times * inner.read;
    extent.sources += inner.sources;
    if (extent.sources <= most_sources) return;
    throw Error("the VRT {} has more than {} sources, with those of its sources", vrt,
                most_sources);
  }

  std::map<std::string, Extent> known_;
};

}  // namespace

void check_vrt(const std::string& path) {
  checked_file(path);
  VrtCheck().extent_of(path, 1);
}

}  // namespace groundray
