#pragma once

#include <glm/vec3.hpp>

/// Elementary functions that return the same bits on every machine, so that results are the same;
/// those of the C library differ between versions and processors. Within 1 unit in the last place
/// (erfc 1.5) where the result is above 1e-300, |x| below 1e154 for asinh and 709.7 for sinh, and x
/// below 1e307 for log1p; zeros, infinities and NaN as in the C standard. Square roots, rounding,
/// fma and remainders of std are exact everywhere.
namespace groundray::math {

double sin(double angle_rad) noexcept;              ///< Returns the sine.
double cos(double angle_rad) noexcept;              ///< Returns the cosine.
double tan(double angle_rad) noexcept;              ///< Returns the tangent.
double asin(double sine) noexcept;                  ///< Returns the angle from -pi/2 to pi/2, rad.
double acos(double cosine) noexcept;                ///< Returns the angle from 0 to pi, rad.
double atan(double tangent) noexcept;               ///< Returns the angle from -pi/2 to pi/2, rad.
double atan2(double y, double x) noexcept;          ///< Returns the angle of (x, y), rad.
double sinh(double x) noexcept;                     ///< Returns the hyperbolic sine.
double asinh(double x) noexcept;                    ///< Returns the inverse of sinh.
double exp(double x) noexcept;                      ///< Returns e to the power of x.
double exp2(double x) noexcept;                     ///< Returns 2 to the power of x.
double expm1(double x) noexcept;                    ///< Returns exp(x) - 1, exact for small x too.
double log(double x) noexcept;                      ///< Returns the natural logarithm.
double log2(double x) noexcept;                     ///< Returns the logarithm to base 2.
double log10(double x) noexcept;                    ///< Returns the logarithm to base 10.
double log1p(double x) noexcept;                    ///< Returns log(1 + x), exact for small x too.
double pow(double base, double exponent) noexcept;  ///< Returns the base to the exponent's power.
double cbrt(double x) noexcept;                     ///< Returns the cube root.
double hypot(double x, double y) noexcept;          ///< Returns the length of (x, y).
double erf(double x) noexcept;                      ///< Returns the error function, to 2.3e-16.
double erfc(double x) noexcept;                     ///< Returns 1 - erf(x), exact for large x too.

/// Returns e to the power of each component.
glm::dvec3 exp(const glm::dvec3& x) noexcept;

}  // namespace groundray::math
