#include "test/support/lens_samples.h"

namespace groundray::testing {

PixelScale centred(double focal_px, glm::ivec2 size_px) {
  return {glm::dvec2(focal_px), (glm::dvec2(size_px) - 1.0) / 2.0, 0};
}

std::vector<LensSample> sample_lenses() {
  const glm::ivec2 wide(240, 136), square(160, 160);
  const PixelScale mild = centred(120, wide);
  const PixelScale askew{{118.3, 121.7}, {112.4, 70.9}, 0.013};
  const auto angle_to_pixels = FTheta::Polynomial::AngleToPixels;
  const auto pixels_to_angle = FTheta::Polynomial::PixelsToAngle;
  return {
      {"pinhole", Pinhole{mild}, wide},
      {"pinhole, off centre", Pinhole{{{300, 250}, {-40, 210}, 0}}, wide},
      {"pinhole, skew", Pinhole{askew}, wide},
      {"radtan 4", BrownConrady{askew, {-0.28, 0.07, 2e-4, -3e-4}}, wide},
      {"radtan 5", BrownConrady{mild, {-0.30, 0.12, 1e-3, -5e-4, -0.02}}, wide},
      {"radtan 5, pincushion", BrownConrady{mild, {0.2, 0.05, -1e-3, 2e-3, 0.01}}, wide},
      {"action camera", BrownConrady{centred(125, wide), {-0.36, 0.14, 0, 0, -0.024}}, wide},
      // github.com/opencv/opencv/issues/20736: a pole and a root 1e-5 apart.
      {"rational 8, pole",
       BrownConrady{
           centred(151, wide),
           {2.9972164630889893, -6.0928826332092285, 0.0005746248061768711, -4.857033854932524e-05,
            -1.2618762254714966, 3.5340938568115234, -4.270793914794922, -5.302351951599121}},
       wide},
      {"rational 8", BrownConrady{mild, {0.5, -2.6, 5e-4, -2e-4, 1.5, 0.4, -2.4, 1.4}}, wide},
      {"thin prism 12",
       BrownConrady{mild, {-0.3, 0.12, 1e-3, -5e-4, 0, 0, 0, 0, 1e-3, 5e-4, -1e-3, 2e-4}}, wide},
      {"tilted 14",
       BrownConrady{mild,
                    {-0.30, 0.12, 1e-3, -5e-4, -0.02, 0.01, 0.02, 0, 1e-3, 5e-4, -1e-3, 2e-4, 0.035,
                     -0.052}},
       wide},
      {"tangential, strong", BrownConrady{mild, {-0.3, 0.1, 0.05, -0.08}}, wide},
      {"fisheye, ideal", KannalaBrandt{centred(60, square), {}}, square},
      {"fisheye 150", KannalaBrandt{centred(70, wide), {0.01, -5e-3, 2e-3, -1e-3}}, wide},
      // Calibration of TUM-VI, at 0.3 of its image size.
      {"fisheye 190", KannalaBrandt{{{59.7, 59.6}, {79.3, 80.1}, 0}, {3.5e-3, 7e-4, -2e-3, 2e-4}},
       square},
      {"fisheye, folds", KannalaBrandt{centred(50, square), {-0.08, 0.01, -0.002, 1e-4}}, square},
      {"f-theta, forward",
       FTheta{{119.2, 67.8}, angle_to_pixels, {50, -0.4, 0.6}, {1.001, 2e-3, -1e-3}}, wide},
      {"f-theta, backward", FTheta{{119.5, 67.5}, pixels_to_angle, {0.0196, 6e-7, -5e-8}}, wide},
      {"f-theta, folds", FTheta{{119.5, 67.5}, pixels_to_angle, {0.0196, 0, -6e-7}}, wide},
      {"eucm", Eucm{{{59.7, 59.7}, {79.7, 80.3}, 0}, 0.63, 1.04}, square},
      {"eucm, below a half", Eucm{centred(60, square), 0.35, 1.3}, square},
      {"eucm, folds", Eucm{centred(30, square), 0.75, 0.9}, square},
      {"double sphere", DoubleSphere{{{49.5, 49.4}, {79.6, 80.3}, 0}, -0.172, 0.593}, square},
      {"double sphere, below a half", DoubleSphere{centred(60, square), 0.3, 0.4}, square},
      {"double sphere, folds", DoubleSphere{centred(30, square), -0.2, 0.7}, square},
      {"mei", Mei{centred(110, wide), 0.8, {-0.2, 0.05, 1e-3, 3e-4}}, wide},
      {"mei, mirror", Mei{{{160, 158}, {81, 78}, 0.01}, 1.4, {-0.25, 0.08, -1e-3, 2e-3}}, square},
      {"mei, folds", Mei{centred(70, square), 1.6, {}}, square},
      {"equirectangular", Equirectangular{}, {240, 120}},
  };
}

}  // namespace groundray::testing
