#pragma once

#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/math.h"
#include "sensors/camera/lens/dual.h"

// Lens models. Each is a struct of its parameters with a function `image`, which returns the pixel
// of a direction in the camera frame C (x right, y down, z ahead). It is a template on the number
// type, so that Dual gives derivatives. Integer coordinates are pixel centres.
namespace groundray {

/// Direction in C, unit.
template <typename T>
struct Direction {
  T x, y, z;
};
/// Position in the image, px.
template <typename T>
struct Pixel {
  T u, v;
};

/// Image of a direction that the model does not image.
template <typename T>
inline const Pixel<T> nowhere{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::quiet_NaN()};

/// Last step of most models: u = f_u (x + skew y) + c_u, v = f_v y + c_v.
struct PixelScale {
  glm::dvec2 focal_px{0};
  glm::dvec2 centre_px{0};
  double skew = 0;

  template <typename T>
  Pixel<T> operator()(const T& x, const T& y) const {
    return {focal_px.x * (x + skew * y) + centre_px.x, focal_px.y * y + centre_px.y};
  }
};

/// Pinhole: x = X / Z, y = Y / Z.
struct Pinhole {
  PixelScale scale;

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    return scale(p.x / p.z, p.y / p.z);
  }
  /// Returns the direction of a pixel. Only models with a closed form define it.
  template <typename T>
  Direction<T> ray(const Pixel<T>& pixel) const {
    using std::sqrt;
    const T y = (pixel.v - scale.centre_px.y) / scale.focal_px.y;
    const T x = (pixel.u - scale.centre_px.x) / scale.focal_px.x - scale.skew * y;
    const T inverse = 1.0 / sqrt(x * x + y * y + 1.0);
    return {x * inverse, y * inverse, inverse};
  }
};

/// Returns the homography from the plane z = 1 to a sensor rotated by R_y(tau_y) R_x(tau_x), both
/// seen from the pinhole.
glm::dmat3 sensor_homography(double tau_x_rad, double tau_y_rad);

/// Pinhole with radial, tangential and thin-prism distortion, on a sensor that may be tilted.
/// Coefficients are in OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y; omitted
/// ones are 0.
/// @see OpenCV, Camera Calibration and 3D Reconstruction; Brown, Decentering distortion of lenses
///      (1966).
struct BrownConrady {
  PixelScale scale;
  std::array<double, 14> k{};
  /// Homography from the upright to the tilted sensor: sensor_homography(tau), set by Lens.
  glm::dmat3 sensor{1};

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    // Even terms would also image directions behind the camera.
    if (!(value_of(p.z) > 0)) return nowhere<T>;
    const T x = p.x / p.z, y = p.y / p.z;
    const T xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
    const T above = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    const T below = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
    const T radial = above / below;
    const T xd = x * radial + 2 * k[2] * xy + k[3] * (r2 + 2.0 * xx) + r2 * (k[8] + k[9] * r2);
    const T yd = y * radial + k[2] * (r2 + 2.0 * yy) + 2 * k[3] * xy + r2 * (k[10] + k[11] * r2);
    if (k[12] == 0 && k[13] == 0) return scale(xd, yd);
    return tilted(xd, yd);
  }

 private:
  template <typename T>
  Pixel<T> tilted(const T& x, const T& y) const {
    const glm::dmat3& m = sensor;
    const T a = m[0][0] * x + m[1][0] * y + m[2][0];
    const T b = m[0][1] * x + m[1][1] * y + m[2][1];
    const T c = m[0][2] * x + m[1][2] * y + m[2][2];
    return scale(a / c, b / c);
  }
};

/// Returns theta / sin(theta), where theta = atan2(sqrt(x^2 + y^2), z) is the angle to the optical
/// axis.
template <typename T>
T angle_per_sine(const Direction<T>& p) {
  const T square = p.x * p.x + p.y * p.y;
  // Series near the axis, where the square root has no derivative; the next term is below 1e-25.
  if (value_of(square) < 1e-8 && value_of(p.z) > 0)
    return 1.0 + square * (1.0 / 6 + square * (3.0 / 40));
  using math::atan2;
  using std::sqrt;
  const T sine = sqrt(square);
  return atan2(sine, p.z) / sine;
}

/// Fisheye: theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), valid beyond
/// 90 degrees.
/// @see Kannala and Brandt, A generic camera model and calibration method, PAMI 28(8) (2006).
struct KannalaBrandt {
  PixelScale scale;
  std::array<double, 4> k{};

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    const T per_sine = angle_per_sine(p);
    const T t2 = per_sine * per_sine * (p.x * p.x + p.y * p.y);
    const T factor = per_sine * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    return scale(factor * p.x, factor * p.y);
  }
};

/// NVIDIA's f-theta model: a polynomial between the distance from the centre, px, and the angle to
/// the axis, rad, in either direction; then a linear map [c d; e 1] of the offset.
struct FTheta {
  enum class Polynomial { AngleToPixels, PixelsToAngle };
  glm::dvec2 centre_px{0};
  Polynomial direction = Polynomial::PixelsToAngle;
  /// Coefficients of the first power, the second...; there is no constant term.
  std::vector<double> k;
  glm::dvec3 linear{1, 0, 0};                            ///< c, d, e
  double top = std::numeric_limits<double>::infinity();  ///< top_of(k), set by Lens

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    const T per_sine = angle_per_sine(p);
    const T square = p.x * p.x + p.y * p.y;
    T theta = 0.0;
    if (value_of(square) >= 1e-16) {
      using std::sqrt;
      theta = per_sine * sqrt(square);
    }
    const T ratio =
        direction == Polynomial::AngleToPixels ? over(theta) : 1.0 / over(radius_px(theta));
    const T x = ratio * per_sine * p.x, y = ratio * per_sine * p.y;
    return {linear.x * x + linear.y * y + centre_px.x, linear.z * x + y + centre_px.y};
  }

  /// Returns the polynomial divided by its argument.
  template <typename T>
  T over(const T& t) const {
    T sum = 0.0;
    for (std::size_t i = k.size(); i-- > 0;) sum = sum * t + k[i];
    return sum;
  }
  /// Returns the derivative of the polynomial.
  double slope(double t) const {
    double sum = 0;
    for (std::size_t i = k.size(); i-- > 0;) sum = sum * t + static_cast<double>(i + 1) * k[i];
    return sum;
  }

 private:
  // Solves polynomial(r) = theta on the branch that begins at 0; NaN beyond its first maximum.
  double root(double theta) const;
  double radius_px(double theta) const { return root(theta); }
  Dual radius_px(const Dual& theta) const {
    const double radius = root(theta.value);
    return theta.chain(radius, 1 / slope(radius));
  }
};

/// Returns the smallest positive argument at which a polynomial without constant term ceases to
/// rise; infinity if it rises forever.
/// @param k  coefficients from the first power on; the first is positive.
double top_of(const std::vector<double>& k);

/// Enhanced unified camera model; with beta = 1, the unified camera model.
/// @see Khomutenko, Garcia and Martinet, An enhanced unified camera model, RA-L 1(1) (2016).
struct Eucm {
  PixelScale scale;
  double alpha = 0;  ///< 0 (a pinhole) to 1
  double beta = 1;   ///< > 0

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    using std::sqrt;
    const T below = alpha * sqrt(beta * (p.x * p.x + p.y * p.y) + p.z * p.z) + (1 - alpha) * p.z;
    return scale(p.x / below, p.y / below);
  }
};

/// Double sphere model: projection onto two spheres in succession, then a pinhole.
/// @see Usenko, Demmel and Cremers, The double sphere camera model, 3DV (2018).
struct DoubleSphere {
  PixelScale scale;
  double xi = 0;
  double alpha = 0;  ///< 0 to 1

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    using std::sqrt;
    const T shifted = xi + p.z;
    const T below = alpha * sqrt(p.x * p.x + p.y * p.y + shifted * shifted) + (1 - alpha) * shifted;
    return scale(p.x / below, p.y / below);
  }
};

/// Catadioptric camera, or one that is equivalent: a sphere, then a pinhole with distortion k1 k2
/// p1 p2.
/// @see Mei and Rives, Single view point omnidirectional camera calibration, ICRA (2007).
struct Mei {
  PixelScale scale;
  double xi = 0;  ///< >= 0
  std::array<double, 4> k{};

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    const T below = p.z + xi;
    if (!(value_of(below) > 0)) return nowhere<T>;
    const T x = p.x / below, y = p.y / below;
    const T xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
    const T radial = 1.0 + r2 * (k[0] + r2 * k[1]);
    return scale(x * radial + 2 * k[2] * xy + k[3] * (r2 + 2.0 * xx),
                 y * radial + k[2] * (r2 + 2.0 * yy) + 2 * k[3] * xy);
  }
};

/// Image of all directions: longitude across, latitude down; the middle of the image looks ahead.
struct Equirectangular {
  glm::dvec2 size_px{0};  ///< size of the image, set by Lens

  template <typename T>
  Pixel<T> image(const Direction<T>& p) const {
    using math::asin;
    using math::atan2;
    return {(atan2(p.x, p.z) / (2 * std::numbers::pi) + 0.5) * size_px.x - 0.5,
            (asin(p.y) / std::numbers::pi + 0.5) * size_px.y - 0.5};
  }
  static constexpr bool images_all = true;  ///< only models without a limit define it

  /// Returns the direction of a pixel, as Pinhole.
  template <typename T>
  Direction<T> ray(const Pixel<T>& pixel) const {
    using math::cos;
    using math::sin;
    const T longitude = ((pixel.u + 0.5) / size_px.x - 0.5) * (2 * std::numbers::pi);
    const T latitude = ((pixel.v + 0.5) / size_px.y - 0.5) * std::numbers::pi;
    return {cos(latitude) * sin(longitude), sin(latitude), cos(latitude) * cos(longitude)};
  }
};

/// Any lens model. A new one is a struct as above, and one line here.
using LensModel = std::variant<Pinhole, BrownConrady, KannalaBrandt, FTheta, Eucm, DoubleSphere,
                               Mei, Equirectangular>;

/// Returns the angles from the axis, ascending, rad, at which the polynomial of a model's radial
/// part has a fold, a root or a pole. Between two of them it images all directions or none.
/// Tangential and thin-prism terms are not considered.
std::vector<double> turns_rad(const LensModel& model);

/// Records every parameter of a model that is out of bounds.
void check_lens(const LensModel& model, Violations& broken);

}  // namespace groundray
