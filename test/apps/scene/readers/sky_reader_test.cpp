#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "apps/scene/readers/readers.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::sky_reader_test {
namespace {

using namespace std::chrono_literals;
using namespace std::string_view_literals;
using groundray::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

SkySpec parse(const std::string& text, const std::filesystem::path& path = "scenes/sky.yaml") {
  const yaml::Node node = yaml::parse(text, path);
  yaml::Faults faults(path);
  SkySpec sky = read_sky(yaml::Map(node, "sky", faults), path, faults);
  faults.throw_if_any();
  return sky;
}

TEST(SkyReader, ReadsAConstantSky) {
  EXPECT_EQ(std::get<ConstantSky>(parse("constant: {radiance_w_m2_sr: [1, 2, 3]}").dome).radiance,
            glm::dvec3(1, 2, 3));
  EXPECT_EQ(std::get<ConstantSky>(parse("constant: {radiance_w_m2_sr: 4}").dome).radiance,
            glm::dvec3(4));
  EXPECT_EQ(std::get<ConstantSky>(parse("turbidity: 2").dome).radiance, glm::dvec3(0));
}

// Writes a Radiance image of one column; `pixels` holds R, G, B and exponent of each pixel.
void write_hdr(const std::filesystem::path& file, std::string_view lines, std::string_view pixels) {
  std::ofstream(file, std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"
                                        << lines << "\n-Y " << pixels.size() / 4 << " +X 1\n"
                                        << pixels;
}

TEST(SkyReader, ReadsAnEnvironmentImage) {
  const TemporaryFolder folder;
  write_hdr(folder / "forest.hdr", "", "\x80\x80\x80\x81\x40\x40\x40\x81"sv);
  const auto dome = std::get<EnvironmentImage>(
      parse("environment: {image: forest.hdr, center_azimuth_deg: 30, illuminance_lux: 2e4}",
            folder / "sky.yaml")
          .dome);
  EXPECT_EQ(dome.image, folder / "forest.hdr");
  EXPECT_EQ(dome.center_azimuth_deg, 30);
  EXPECT_EQ(std::get<IlluminanceScale>(dome.scale).lux, 2e4);
  const std::string absolute = (folder / "forest.hdr").string();
  const auto as_is =
      std::get<EnvironmentImage>(parse("environment: {image: " + absolute + "}").dome);
  EXPECT_EQ(as_is.image, absolute);
  EXPECT_EQ(std::get<RadianceScale>(as_is.scale).factor, 1);
}

TEST(SkyReader, RejectsEnvironmentImagesThatAreNotSkies) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& keys, const std::string& why) {
    EXPECT_THAT(
        [&] { parse("turbidity: 2\nenvironment: {" + keys + "}", folder / "sky.yaml"); },
        ThrowsMessage<Error>(AllOf(
            HasSubstr("sky.yaml:2:22: key 'image': cannot be used as the sky:\n"), HasSubstr(why))))
        << keys;
  };
  refused("image: none.hdr", "none.hdr");
  write_hdr(folder / "infinite.hdr", "EXPOSURE=1e-30\n", "\x80\x40\x20\xff"sv);
  refused("image: infinite.hdr", "is inf; light must be finite");
  write_hdr(folder / "dark.hdr", "", "\0\0\0\0"sv);
  refused("image: dark.hdr", "every pixel is 0");
  // Light only from below.
  write_hdr(folder / "turned.hdr", "", "\0\0\0\0\0\0\0\0\0\0\0\0\x80\x80\x80\x81"sv);
  refused("image: turned.hdr, illuminance_lux: 1e4", "is it upside down?");
  std::ofstream(folder / "text.hdr") << "no image";
  refused("image: text.hdr", "text.hdr");
}

TEST(SkyReader, ReadsAClearSkyByTimeAndPlace) {
  const SkySpec sky = parse(R"(analytic: {ground_albedo: [0.1, 0.2, 0.3]}
turbidity: 4.5
water_cm: 2
ozone_cm: 0.3
pressure_hpa: 820
sun: {utc: 2003-10-17T19:30:30Z, latitude_deg: 39.742476, longitude_deg: -105.1786,
      temperature_c: 11, disc: uniform}
)");
  EXPECT_EQ(std::get<AnalyticSky>(sky.dome).ground_albedo, glm::dvec3(0.1, 0.2, 0.3));
  EXPECT_EQ(sky.air.turbidity, 4.5);
  EXPECT_EQ(sky.air.water_cm, 2);
  EXPECT_EQ(sky.air.ozone_cm, 0.3);
  EXPECT_EQ(sky.air.pressure_hpa, 820);
  ASSERT_TRUE(sky.sun);
  EXPECT_EQ(sky.sun->disc, SunDisc::Uniform);
  const auto& sun = std::get<SunTime>(sky.sun->position);
  EXPECT_EQ(sun.utc, std::chrono::sys_days(2003y / 10 / 17) + 19h + 30min + 30s);
  EXPECT_EQ(sun.latitude_deg, 39.742476);
  EXPECT_EQ(sun.longitude_deg, -105.1786);
  EXPECT_EQ(sun.temperature_c, 11);
}

TEST(SkyReader, ReadsASunByItsAngles) {
  const SkySpec sky = parse("sun: {azimuth_deg: 200, elevation_deg: 12, distance_au: 0.99}");
  const auto& sun = std::get<SunAngles>(sky.sun->position);
  EXPECT_EQ(sun.azimuth_deg, 200);
  EXPECT_EQ(sun.elevation_deg, 12);
  EXPECT_EQ(sun.distance_au, 0.99);
  EXPECT_EQ(sky.sun->disc, SunDisc::LimbDarkened);
}

TEST(SkyReader, ErrorListsEveryFaultWithItsLine) {
  EXPECT_THAT(
      [] {
        parse(R"(analytic: {ground_albedo: 20}
constant: {radiance_w_m2_sr: [1, 2]}
turbidty: 3
sun:
  utc: 2003-02-30T19:30:30Z
  latitude_deg: north
  disc: round
)");
      },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("scenes/sky.yaml:1:1: key 'sky': must have at most one of 'constant', "),
          HasSubstr("sky.yaml:1:27: key 'ground_albedo': is 20, but must be from 0 to 1"),
          HasSubstr(
              "sky.yaml:2:30: key 'radiance_w_m2_sr': is a list of 2, but must be a list of 3"),
          HasSubstr("sky.yaml:3:1: key 'turbidty': unknown; did you mean 'turbidity'?"),
          HasSubstr("sky.yaml:5:8: key 'utc': is '2003-02-30T19:30:30Z', but must be a time like"),
          HasSubstr("sky.yaml:6:17: key 'latitude_deg'"), HasSubstr("'longitude_deg'"),
          HasSubstr("sky.yaml:7:9: key 'disc'"))));
}

TEST(SkyReader, RejectsInvalidTimes) {
  for (const char* utc : {"2003-10-17", "2003-10-17T19:30:30", "2003-10-17T19:30:30+01:00",
                          "2003-10-17 19:30:30Z", "2003-10-17T24:00:00Z", "2003-10-17T19:60:00Z",
                          "2003-13-01T00:00:00Z", "20031017T193030Z", "2003-1-07T19:30:30Z"}) {
    EXPECT_THAT(
        [&] {
          parse(std::string("sun: {latitude_deg: 0, longitude_deg: 0, utc: \"") + utc + "\"}");
        },
        ThrowsMessage<Error>(HasSubstr("must be a time like 2026-06-21T10:30:00Z")))
        << utc;
  }
}

TEST(SkyReader, SunIsGivenByTimeOrByAngles) {
  const auto rule = ThrowsMessage<Error>(HasSubstr("must have either 'utc'"));
  EXPECT_THAT([] { parse("sun: {azimuth_deg: 3}"); }, rule);
  EXPECT_THAT([] { parse("sun: {}"); }, rule);
  EXPECT_THAT(
      [] {
        parse(
            "sun: {utc: 2003-10-17T19:30:30Z, latitude_deg: 0, longitude_deg: 0, elevation_deg: "
            "3}");
      },
      rule);
}

TEST(SkyReader, RejectsInvalidSkiesWithTheirLine) {
  EXPECT_THAT([] { parse("analytic: {}"); },
              ThrowsMessage<Error>(HasSubstr("sky.yaml:1:1: key 'sky': is invalid: SkySpec: an "
                                             "analytic sky needs a sun")));
  EXPECT_THAT([] { parse("analytic: {}\nsun: {azimuth_deg: 0, elevation_deg: -9}"); },
              ThrowsMessage<Error>(HasSubstr("the sun is 9 degrees below the horizon")));
  EXPECT_THAT([] { parse("turbidity: 12"); },
              ThrowsMessage<Error>(HasSubstr("turbidity = 12 must be in [1, 10]")));
  EXPECT_THAT([] { parse("environment: {image: a.exr, radiance_factor: 2, illuminance_lux: 3}"); },
              ThrowsMessage<Error>(HasSubstr("is an alternative to radiance_factor: give one")));
}

}  // namespace
}  // namespace groundray::sky_reader_test
