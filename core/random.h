#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>

namespace groundray {

/// Seed that the user chooses: noise and the positions of plants follow from it. The appearance of
/// relief and models follows from seeds of their own.
struct Seed {
  std::uint64_t value = 0;
};

/// Purpose of a random number. The streams of a pulse are independent of each other.
enum class RandomStream : std::uint32_t {
  RangeNoise = 0,
  EchoNoise,
  FalseAlarm,
  BeamTurn,
  AngularJitter,
  Asset,
  Scatter,
  Relief,
  ShotNoise,
  ReadNoise,
  FixedPattern,
  Paths,
  World
};

/// Key of one random block: equal keys give equal numbers on any thread, in any order.
struct RandomKey {
  Seed seed;
  std::uint32_t sensor = 0;
  std::uint32_t frame = 0;
  std::uint32_t pulse = 0;
  std::uint32_t sub_ray = 0;
  RandomStream stream = RandomStream::RangeNoise;
};

/// Returns 128 random bits that are a function of `key` alone.
/// @see Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (2011): Philox4x32-10.
std::array<std::uint32_t, 4> random_bits(const RandomKey& key) noexcept;

/// Returns two independent numbers, uniform in the open interval (0, 1), with 52 bits each.
glm::dvec2 random_uniform(const RandomKey& key) noexcept;

/// Returns two independent normally distributed numbers of mean 0 and standard deviation 1
/// (Box-Muller).
glm::dvec2 random_normal(const RandomKey& key) noexcept;

/// Returns a Poisson-distributed number, exact except for rounding, for means up to 1e9. Uses the
/// blocks of `key` from its sub_ray on.
/// @param mean  >= 0; larger ones count as 1e9.
/// @see Hoermann, The transformed rejection method for generating Poisson random variables,
///      Insurance: Mathematics and Economics 12 (1993): PTRS.
double random_poisson(RandomKey key, double mean) noexcept;

}  // namespace groundray
