#pragma once

namespace glm {

template <typename T>
struct vec2_of {
  T x, y;

  vec2_of() = default;
  constexpr explicit vec2_of(T all) : x(all), y(all) {}
  template <typename A, typename B>
  constexpr vec2_of(A a, B b) : x(static_cast<T>(a)), y(static_cast<T>(b)) {}
  template <typename U>
  constexpr explicit vec2_of(const vec2_of<U>& o) : x(static_cast<T>(o.x)), y(static_cast<T>(o.y)) {}

  friend constexpr vec2_of operator+(const vec2_of& a, const vec2_of& b) { return {a.x + b.x, a.y + b.y}; }
  friend constexpr vec2_of operator-(const vec2_of& a, const vec2_of& b) { return {a.x - b.x, a.y - b.y}; }
  friend constexpr vec2_of operator*(const vec2_of& a, const vec2_of& b) { return {a.x * b.x, a.y * b.y}; }
  friend constexpr vec2_of operator+(const vec2_of& a, T b) { return {a.x + b, a.y + b}; }
  friend constexpr vec2_of operator-(const vec2_of& a, T b) { return {a.x - b, a.y - b}; }
  friend constexpr vec2_of operator*(const vec2_of& a, T b) { return {a.x * b, a.y * b}; }
  friend constexpr vec2_of operator/(const vec2_of& a, T b) { return {a.x / b, a.y / b}; }
  friend constexpr vec2_of operator>>(const vec2_of& a, T b) { return {a.x >> b, a.y >> b}; }
  friend constexpr vec2_of operator<<(const vec2_of& a, T b) { return {a.x << b, a.y << b}; }
  friend constexpr bool operator==(const vec2_of& a, const vec2_of& b) { return a.x == b.x && a.y == b.y; }
};

using ivec2 = vec2_of<int>;
using dvec2 = vec2_of<double>;

}  // namespace glm
