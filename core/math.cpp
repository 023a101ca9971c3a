#include "core/math.h"

#include <sleef.h>

// SLEEF's finz functions return the same bits on every processor; they compute with FMA. Versions
// 3.5.1 and 3.6.1 agree in all that are used here; their erf differs, hence 1 - erfc.
namespace groundray::math {

double sin(double angle_rad) noexcept { return Sleef_finz_sind1_u10purecfma(angle_rad); }
double cos(double angle_rad) noexcept { return Sleef_finz_cosd1_u10purecfma(angle_rad); }
double tan(double angle_rad) noexcept { return Sleef_finz_tand1_u10purecfma(angle_rad); }
double asin(double sine) noexcept { return Sleef_finz_asind1_u10purecfma(sine); }
double acos(double cosine) noexcept { return Sleef_finz_acosd1_u10purecfma(cosine); }
double atan(double tangent) noexcept { return Sleef_finz_atand1_u10purecfma(tangent); }
double atan2(double y, double x) noexcept { return Sleef_finz_atan2d1_u10purecfma(y, x); }
double sinh(double x) noexcept { return Sleef_finz_sinhd1_u10purecfma(x); }
double asinh(double x) noexcept { return Sleef_finz_asinhd1_u10purecfma(x); }
double exp(double x) noexcept { return Sleef_finz_expd1_u10purecfma(x); }
double exp2(double x) noexcept { return Sleef_finz_exp2d1_u10purecfma(x); }
double expm1(double x) noexcept { return Sleef_finz_expm1d1_u10purecfma(x); }
double log(double x) noexcept { return Sleef_finz_logd1_u10purecfma(x); }
double log2(double x) noexcept { return Sleef_finz_log2d1_u10purecfma(x); }
double log10(double x) noexcept { return Sleef_finz_log10d1_u10purecfma(x); }
double log1p(double x) noexcept { return Sleef_finz_log1pd1_u10purecfma(x); }
double pow(double base, double exponent) noexcept {
  return Sleef_finz_powd1_u10purecfma(base, exponent);
}
double cbrt(double x) noexcept { return Sleef_finz_cbrtd1_u10purecfma(x); }
double hypot(double x, double y) noexcept { return Sleef_finz_hypotd1_u05purecfma(x, y); }
double erf(double x) noexcept { return 1 - erfc(x); }
double erfc(double x) noexcept { return Sleef_finz_erfcd1_u15purecfma(x); }

glm::dvec3 exp(const glm::dvec3& x) noexcept { return {exp(x.x), exp(x.y), exp(x.z)}; }

}  // namespace groundray::math
