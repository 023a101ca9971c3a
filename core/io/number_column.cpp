#include "core/io/number_column.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

namespace groundray {
namespace {

template <typename T>
T load(const char* from, ByteOrder order) {
  std::array<char, sizeof(T)> bytes;
  std::copy_n(from, sizeof(T), bytes.begin());
  if (order == ByteOrder::Big) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

/// Converts an IEEE 754 binary16 number; a float represents each of them exactly.
float float_of_half(std::uint16_t bits) {
  constexpr int fraction_bits = 10, bias = 15;
  const float sign = (bits >> 15) != 0 ? -1.f : 1.f;
  const int exponent = (bits >> fraction_bits) & 0x1f;
  const auto fraction = static_cast<float>(bits & 0x3ff);
  if (exponent == 0x1f) {
    return fraction > 0 ? std::numeric_limits<float>::quiet_NaN()
                        : sign * std::numeric_limits<float>::infinity();
  }
  if (exponent == 0) return sign * std::ldexp(fraction, 1 - bias - fraction_bits);
  return sign * std::ldexp(1024 + fraction, exponent - bias - fraction_bits);
}

template <typename T>
void add_as(PointCloud& cloud, std::string_view name, const NumberRun& run) {
  const char* at = run.first;
  for (T& value : cloud.add<T>(name)) {
    value = load<T>(at, run.order);
    at += run.step_bytes;
  }
}

void add_halves(PointCloud& cloud, std::string_view name, const NumberRun& run) {
  const char* at = run.first;
  for (float& value : cloud.add<float>(name)) {
    value = float_of_half(load<std::uint16_t>(at, run.order));
    at += run.step_bytes;
  }
}

/// Returns the origin to subtract from integers in [low, high] so that doubles represent them
/// exactly; 0 if none is needed or none suffices.
template <typename T>
std::int64_t origin_of(T low, T high) {
  constexpr std::int64_t most = std::int64_t{1} << std::numeric_limits<double>::digits;
  const bool fits = std::cmp_greater_equal(low, -most) && std::cmp_less_equal(high, most);
  if (fits || !std::in_range<std::int64_t>(low)) return 0;
  const auto spread = static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
  return std::cmp_less_equal(spread, most) ? static_cast<std::int64_t>(low) : 0;
}

template <typename T>
void add_wide(PointCloud& cloud, std::string_view name, const NumberRun& run,
              std::vector<ColumnOrigin>& origins) {
  T low = std::numeric_limits<T>::max(), high = std::numeric_limits<T>::min();
  const char* at = run.first;
  for (std::size_t row = 0; row < cloud.rows(); ++row, at += run.step_bytes) {
    const T value = load<T>(at, run.order);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  const std::span<double> values = cloud.add<double>(name);
  const std::int64_t origin = values.empty() ? 0 : origin_of(low, high);
  at = run.first;
  for (double& value : values) {
    const T number = load<T>(at, run.order);
    value = origin == 0 ? static_cast<double>(number)
                        : static_cast<double>(static_cast<std::uint64_t>(number) -
                                              static_cast<std::uint64_t>(origin));
    at += run.step_bytes;
  }
  if (origin != 0) origins.push_back({std::string(name), origin});
}

}  // namespace

std::size_t size_of(NumberType type) {
  return with_number_type(type, [](auto number) { return sizeof number; });
}

std::optional<NumberType> number_type_of(char kind, std::size_t bytes) {
  constexpr std::string_view kinds = "fffiiiiuuuub";  // of the NumberTypes, in their order
  static_assert(kinds.size() == std::tuple_size_v<NumberTypes>);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const auto type = static_cast<NumberType>(i);
    if (kinds[i] == kind && size_of(type) == bytes) return type;
  }
  return std::nullopt;
}

void add_column(PointCloud& cloud, std::string_view name, const NumberRun& run,
                std::vector<ColumnOrigin>& origins) {
  if (run.type == NumberType::Float16) return add_halves(cloud, name, run);
  with_number_type(run.type, [&]<typename T>(T /*of the type*/) {
    if constexpr (std::is_integral_v<T> && sizeof(T) == 8) {
      add_wide<T>(cloud, name, run, origins);
    } else {
      add_as<T>(cloud, name, run);
    }
  });
}

}  // namespace groundray
