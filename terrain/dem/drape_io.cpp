#include "terrain/dem/drape_io.h"

#include <cpl_string.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/image/image_io.h"
#include "terrain/dem/dem_warp.h"
#include "terrain/dem/raster_input.h"

namespace groundray {
namespace {

// Flips an image so that its first row is in the north and its first column in the west.
template <typename T>
void turn_north_up(Image<T>& image, glm::dvec2 step_m) {
  const int last_row = image.height() - 1;
  const int last_column = image.width() - 1;
  for (int y = 0; step_m.y > 0 && y < last_row - y; ++y) {
    std::swap_ranges(image.at(0, y).data(), std::to_address(image.at(last_column, y).end()),
                     image.at(0, last_row - y).data());
  }
  for (int y = 0; step_m.x < 0 && y <= last_row; ++y) {
    for (int x = 0; x < last_column - x; ++x) {
      std::ranges::swap_ranges(image.at(x, y), image.at(last_column - x, y));
    }
  }
}

// Returns the image as a drape. `corner_m` is the outer corner of pixel (0, 0), in D.
Drape laid_down(Texture image, glm::dvec2 corner_m, glm::dvec2 step_m) {
  const glm::dvec2 extent_m = glm::dvec2(image.size()) * step_m;
  return {std::move(image), glm::min(corner_m, corner_m + extent_m), glm::abs(extent_m)};
}

// Returns the values as fractions of `full`.
ImageF shares_of(const PlacedRaster& raster, double full) {
  constexpr float slack = 1e-5f;  // for scales written with six digits
  ImageF image(raster.size.x, raster.size.y, 1);
  for (std::size_t i = 0; i < raster.values.size(); ++i) {
    const float value = raster.values[i];
    const float share = std::isnan(value) ? 0 : static_cast<float>(value / full);
    image.values()[i] = std::clamp(share, 0.0f, 1.0f);
    if (-slack <= share && share <= 1 + slack) continue;
    const auto columns = static_cast<std::size_t>(raster.size.x);
    const float most = *std::ranges::max_element(
        raster.values, [](float a, float b) { return std::isnan(a) ? !std::isnan(b) : a < b; });
    throw Error("its value in column {}, row {}{} is {}; it must be from 0 to mask_full = {}: {}",
                i % columns, i / columns, raster.is_warped ? " of the warped raster" : "", value,
                full,
                share < 0 ? fmt::format("set mask_nodata: {} if it means no cover", value)
                          : fmt::format("set mask_full: {0} if {0} means full cover", most));
  }
  return image;
}

// Bands to read of a photo.
struct PhotoBands {
  std::vector<int> colors;  // one (grey, or palette indices), or red, green, blue
  int alpha = 0;            // 0: there is none
  const GDALColorTable* palette = nullptr;
};

void check_bytes(GDALDataset& dataset) {
  for (int i = 1; i <= dataset.GetRasterCount(); ++i) {
    const GDALDataType type = dataset.GetRasterBand(i)->GetRasterDataType();
    if (type == GDT_Byte) continue;
    const bool is_word = type == GDT_UInt16;
    throw Error("its band {} is of type {}; a photo's values must be Byte; {}, run{}", i,
                GDALGetDataTypeName(type),
                is_word ? "with its actual range instead of 0 65535" : "to stretch its range",
                command(dataset.GetDescription(),
                        is_word ? "gdal_translate -ot Byte -scale 0 65535 0 255"
                                : "gdal_translate -ot Byte -scale",
                        "_bytes.tif"));
  }
}

PhotoBands photo_bands(GDALDataset& dataset) {
  check_bytes(dataset);
  PhotoBands bands;
  const int count = dataset.GetRasterCount();
  const auto meaning = [&](int i) { return dataset.GetRasterBand(i)->GetColorInterpretation(); };
  if (count > 1 && meaning(count) == GCI_AlphaBand) bands.alpha = count;
  const int colors = bands.alpha == 0 ? count : count - 1;
  if (colors != 1 && colors != 3) {
    std::vector<std::string> names;
    for (int i = 1; i <= count; ++i) {
      names.emplace_back(GDALGetColorInterpretationName(meaning(i)));
    }
    throw Error(
        "it has {} bands ({}); a photo must have one grey band or red, green and blue bands, and "
        "optionally alpha; select them:{}",
        count, fmt::join(names, ", "),
        command(dataset.GetDescription(),
                colors > 3 ? "gdal_translate -b 1 -b 2 -b 3" : "gdal_translate -b 1", "_rgb.tif"));
  }
  if (colors == 1) {
    bands.colors = {1};
    bands.palette = dataset.GetRasterBand(1)->GetColorTable();
    return bands;
  }
  bands.colors = {1, 2, 3};
  std::vector<int> named;
  for (const GDALColorInterp color : {GCI_RedBand, GCI_GreenBand, GCI_BlueBand}) {
    for (const int i : bands.colors) {
      if (meaning(i) == color) named.push_back(i);
    }
  }
  if (named.size() == 3) bands.colors = std::move(named);
  return bands;
}

// Reads bands of bytes into the channels of `image` from `channel` on, in strips of whole blocks.
void read_bytes(GDALDataset& dataset, std::vector<int> bands, Image8& image, int channel) {
  glm::ivec2 block;
  dataset.GetRasterBand(bands[0])->GetBlockSize(&block.x, &block.y);
  const int rows_at_once = block.y * std::max(1, 256 / block.y);
  const int width = image.width();
  for (int row = 0; row < image.height(); row += rows_at_once) {
    const int rows = std::min(rows_at_once, image.height() - row);
    const GSpacing pixel = image.channels();
    CPLErrorReset();
    const CPLErr result = dataset.RasterIO(
        GF_Read, 0, row, width, rows, image.at(0, row).data() + channel, width, rows, GDT_Byte,
        static_cast<int>(bands.size()), bands.data(), pixel, pixel * width, 1, nullptr);
    if (const std::string fault = fault_of_read(result, dataset); !fault.empty()) {
      throw Error(
          "its pixels in rows {} to {} cannot all be read: {}; was the file cut short? "
          "Copy it again",
          row, row + rows - 1, fault);
    }
  }
}

// Sets alpha to 0 where the masks of all colours hide the pixel. A single colour may equal the
// nodata value in a valid pixel.
void hide_masked(GDALDataset& dataset, const PhotoBands& bands, Image8& photo) {
  std::vector<GDALRasterBand*> masks;
  for (const int i : bands.colors) {
    GDALRasterBand* const band = dataset.GetRasterBand(i);
    const int flags = band->GetMaskFlags();
    if ((flags & (GMF_ALL_VALID | GMF_ALPHA)) != 0) return;
    masks.push_back(band->GetMaskBand());
    if ((flags & GMF_PER_DATASET) != 0) break;
  }
  const int width = photo.width();
  std::vector<std::uint8_t> shown(static_cast<std::size_t>(width)), part(shown.size());
  for (int y = 0; y < photo.height(); ++y) {
    std::ranges::fill(shown, std::uint8_t{0});
    CPLErrorReset();
    for (GDALRasterBand* mask : masks) {
      if (mask->RasterIO(GF_Read, 0, y, width, 1, part.data(), width, 1, GDT_Byte, 0, 0, nullptr) !=
              CE_None ||
          CPLGetLastErrorType() == CE_Failure) {
        throw Error("its mask cannot be read: {}; was the file cut short? Copy it again",
                    CPLGetLastErrorMsg());
      }
      for (std::size_t i = 0; i < part.size(); ++i) shown[i] |= part[i];
    }
    for (int x = 0; x < width; ++x) {
      if (shown[static_cast<std::size_t>(x)] == 0) photo.at(x, y).back() = 0;
    }
  }
}

// Replaces the first of four channels, a palette index, by its colour; indices without one have no
// data.
void look_up(const GDALColorTable& palette, Image8& photo) {
  std::array<std::array<std::uint8_t, 4>, 256> colors{};
  for (int i = 0; i < std::min(palette.GetColorEntryCount(), 256); ++i) {
    GDALColorEntry entry{};
    if (palette.GetColorEntryAsRGB(i, &entry) == 0) {
      throw Error("its palette is not RGB: convert the photo to RGB");
    }
    const std::array values{entry.c1, entry.c2, entry.c3, entry.c4};
    std::ranges::transform(values, colors[static_cast<std::size_t>(i)].begin(),
                           [](short value) { return static_cast<std::uint8_t>(value); });
  }
  for (auto* pixel = photo.values().data(); pixel != std::to_address(photo.values().end());
       pixel += 4) {
    const auto& color = colors[pixel[0]];
    pixel[3] = static_cast<std::uint8_t>((pixel[3] * color[3] + 127) / 255);
    std::copy_n(color.begin(), 3, pixel);
  }
}

// Returns grey and alpha, or red, green, blue and alpha.
Image8 read_photo(GDALDataset& dataset) {
  const PhotoBands bands = photo_bands(dataset);
  const bool is_grey = bands.colors.size() == 1 && bands.palette == nullptr;
  Image8 photo(dataset.GetRasterXSize(), dataset.GetRasterYSize(), is_grey ? 2 : 4);
  std::ranges::fill(photo.values(), std::uint8_t{255});
  read_bytes(dataset, bands.colors, photo, 0);
  if (bands.alpha != 0) read_bytes(dataset, {bands.alpha}, photo, photo.channels() - 1);
  hide_masked(dataset, bands, photo);
  if (bands.palette != nullptr) look_up(*bands.palette, photo);
  return photo;
}

// Returns the photo as a GDAL dataset, without a copy; its last band is alpha.
GDALDatasetUniquePtr photo_dataset(Image8& photo, RasterHeader& header) {
  GDALDriver* const memory = GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDatasetUniquePtr dataset(
      memory->Create("", photo.width(), photo.height(), 0, GDT_Byte, nullptr));
  for (int i = 0; i < photo.channels(); ++i) {
    CPLStringList options;
    const void* const first = photo.values().data() + i;
    options.SetNameValue("DATAPOINTER", fmt::format("{}", first).c_str());
    options.SetNameValue("PIXELOFFSET", fmt::format("{}", photo.channels()).c_str());
    options.SetNameValue("LINEOFFSET",
                         fmt::format("{}", std::int64_t{photo.channels()} * photo.width()).c_str());
    dataset->AddBand(GDT_Byte, options.List());
  }
  dataset->GetRasterBand(photo.channels())->SetColorInterpretation(GCI_AlphaBand);
  dataset->SetGeoTransform(header.geotransform.data());
  if (!header.crs.IsEmpty()) dataset->SetSpatialRef(&header.crs);
  return dataset;
}

// Returns the photo warped to `target` (empty: its own CRS, rotation undone), and sets `header` to
// that of the result.
Image8 warped(Image8 photo, RasterHeader& header, const std::string& target,
              const std::filesystem::path& path) {
  const GDALDatasetUniquePtr source = photo_dataset(photo, header);
  // Scales of 1; by default, they differ from block to block.
  std::vector<std::string> options{"-r",  "bilinear", "-et", "0.01",    "-novshift",
                                   "-wo", "XSCALE=1", "-wo", "YSCALE=1"};
  if (!target.empty()) options.insert(options.end(), {"-t_srs", target});
  const GDALDatasetUniquePtr view = warped_view(*source, options);
  if (view == nullptr) throw Error("it cannot be warped: {}", CPLGetLastErrorMsg());
  header = read_header(*view);
  check_pixels(path, {photo.width(), photo.height()}, header.samples, most_image_pixels);
  Image8 result(header.samples.x, header.samples.y, photo.channels());
  std::vector<int> bands;
  for (int i = 1; i <= photo.channels(); ++i) bands.push_back(i);
  read_bytes(*view, bands, result, 0);
  return result;
}

// Sets the colour of pixels without data to the mean colour of the smallest block of 2^k x 2^k
// pixels, aligned with the image, that contains data.
void fill_colors(Image8& image) {
  const auto colors = static_cast<std::size_t>(image.channels()) - 1;
  Image8 half((image.width() + 1) / 2, (image.height() + 1) / 2, image.channels());
  bool is_full = true;
  for (int y = 0; y < half.height(); ++y) {
    for (int x = 0; x < half.width(); ++x) {
      std::array<int, 4> sums{};
      int count = 0;
      for (int i = 0; i < 4; ++i) {
        const int column = 2 * x + i % 2, row = 2 * y + i / 2;
        if (column >= image.width() || row >= image.height()) continue;
        const auto pixel = image.at(column, row);
        if (pixel.back() == 0) continue;
        for (std::size_t c = 0; c < colors; ++c) sums[c] += pixel[c];
        ++count;
      }
      const auto mean = half.at(x, y);
      for (std::size_t c = 0; c < colors && count > 0; ++c) {
        mean[c] = static_cast<std::uint8_t>((sums[c] + count / 2) / count);
      }
      mean.back() = count > 0 ? 255 : 0;
      is_full &= count > 0;
    }
  }
  if (!is_full) fill_colors(half);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto pixel = image.at(x, y);
      if (pixel.back() == 0) std::ranges::copy(half.at(x / 2, y / 2).first(colors), pixel.begin());
    }
  }
}

// Removes alpha if all pixels are opaque; otherwise fills the colours of pixels without data.
Image8 finished(Image8 photo) {
  const auto channels = static_cast<std::size_t>(photo.channels());
  const auto values = photo.values();
  std::size_t opaque = 0, bare = 0;
  for (std::size_t i = channels - 1; i < values.size(); i += channels) {
    opaque += values[i] == 255;
    bare += values[i] == 0;
  }
  const std::size_t pixels = values.size() / channels;
  if (bare == pixels) {
    throw Error("none of its {} x {} pixels has data; is its nodata value or mask correct?",
                photo.width(), photo.height());
  }
  if (bare > 0) fill_colors(photo);
  if (opaque < pixels) return photo;
  Image8 colors(photo.width(), photo.height(), photo.channels() - 1);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::ranges::copy(values.subspan(i * channels, channels - 1),
                      colors.values().begin() + static_cast<std::ptrdiff_t>(i * (channels - 1)));
  }
  return colors;
}

// Rejects a photo that has to be in W already, but whose CRS cannot be W's.
void check_metric(const RasterHeader& header, GDALDataset& dataset) {
  const std::string why = why_not_metric(header.crs);
  if (why.empty()) return;
  if (header.crs.IsLocal()) {
    throw Error("{}; redefine it in metres with gdal_translate -a_srs and -a_ullr", why);
  }
  const bool has_palette = dataset.GetRasterBand(1)->GetColorTable() != nullptr;
  const std::string program =
      fmt::format("gdalwarp -t_srs {} -r {} -dstalpha", shell_word(fitting_crs(header)),
                  has_palette ? "near" : "bilinear");
  throw Error("{}, and the ground has no CRS to warp it to; run{}", why,
              command(dataset.GetDescription(), program, "_metric.tif"));
}

}  // namespace

Drape load_mask(const std::filesystem::path& path, const MaskOptions& options) {
  return about(path, [&] {
    if (!(options.full > 0) || !std::isfinite(options.full)) {
      throw Error("mask_full = {} must be positive and finite", options.full);
    }
    const PlacedRaster raster =
        load_placed_raster(path, options.nodata, options.crs_wkt, most_image_pixels);
    ImageF image = shares_of(raster, options.full);
    turn_north_up(image, raster.step_m);
    return laid_down(Texture(std::move(image), Wrap::Clamp),
                     raster.corner_w_m - glm::dvec2(options.origin_w_m), raster.step_m);
  });
}

Drape load_orthophoto(const std::filesystem::path& path, const OrthophotoOptions& options) {
  return about(path, [&] {
    const GDALDatasetUniquePtr dataset = open_raster(path);
    RasterHeader header = read_header(*dataset, "gdalwarp -r bilinear -dstalpha");
    flatten(header.crs);
    const auto world = crs_to_reach(header.crs, options.crs_wkt);
    if (!world) check_metric(header, *dataset);
    check_pixels(path, header.samples, header.samples, most_image_pixels);
    check_memory(path, header.samples, 4.0 * header.samples.x * header.samples.y);
    Image8 photo = read_photo(*dataset);
    const bool is_elsewhere = world && header.crs.IsSame(&*world) == 0;
    if (is_elsewhere || header.is_rotated()) {
      photo = warped(std::move(photo), header, is_elsewhere ? wkt_of(*world) : "", path);
    }
    const auto& gt = header.geotransform;
    const glm::dvec2 step_m(gt[1], gt[5]);
    photo = finished(std::move(photo));
    turn_north_up(photo, step_m);
    return laid_down(Texture(std::move(photo), Encoding::Srgb, Wrap::Clamp),
                     glm::dvec2(gt[0], gt[3]) - glm::dvec2(options.origin_w_m), step_m);
  });
}

}  // namespace groundray
