// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/prototypes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "core/decode/find_regions.hpp"
#include "core/decode/grey_moments.hpp"
#include "core/decode/symbol_view.hpp"

namespace slsd {
namespace {

using Covariance = Eigen::Matrix<double, kFeatureCount, kFeatureCount>;

/// What the model leaves out (uneven light, curvature, texture) as a standard deviation of each feature, so that no
/// direction is held for more certain than it is.
constexpr double kFeatureFloor[kFeatureCount] = {0.02, 0.003, 0.003, 0.003, 0.0008, 0.0006, 0.0006, 0.0008};

/// Brings the densities to where floats have room on both sides.
constexpr double kLogVolumeScale = -40;

struct Look {
  GreyMoments moments;
  Eigen::Vector2f centroid_px;
};

/// The region nearest to the middle of the view, measured as the decoder measures it.
std::optional<Look> look_at(const SymbolView& view, const PrototypeOptions& options, Regions& regions) {
  RegionFinder().find(Mask(view.mask.view()), regions);
  const float middle = 0.5F * static_cast<float>(view.image.width() - 1);
  const Region* nearest = nullptr;
  float nearest_px = static_cast<float>(options.symbol_size_px) * 0.5F * options.camera_px_per_projector_px;
  for (const Region& region : regions.regions) {
    const float distance = std::hypot(0.5F * static_cast<float>(region.left + region.right) - middle,
                                      0.5F * static_cast<float>(region.top + region.bottom) - middle);
    if (distance < nearest_px) nearest = &region, nearest_px = distance;
  }
  if (nearest == nullptr) return std::nullopt;
  const float reach =
      0.6F * view.frame.colwise().norm().maxCoeff() * static_cast<float>(options.symbol_size_px + options.spacing_px) +
      1;
  const bool merged =
      static_cast<float>(nearest->left) < middle - reach || static_cast<float>(nearest->right) > middle + reach ||
      static_cast<float>(nearest->top) < middle - reach || static_cast<float>(nearest->bottom) > middle + reach;
  if (merged) return std::nullopt;
  GreyMomentMeter meter(margin_px(options.spacing_px, options.camera_px_per_projector_px));
  const GreyMoments moments = meter.measure(view.image.view(), *nearest, regions.runs_of(*nearest));
  const Eigen::Vector2f from_middle = Eigen::Vector2f(moments.x, moments.y) - view.middle_px;
  return Look{moments, view.frame.inverse() * from_middle};
}

Prototype summarise(const std::vector<ShapeFeatures>& looks) {
  Eigen::Matrix<double, kFeatureCount, 1> mean = decltype(mean)::Zero();
  for (const ShapeFeatures& look : looks) mean += look.cast<double>() / static_cast<double>(looks.size());
  Covariance covariance = Covariance::Zero();
  for (int i = 0; i < kFeatureCount; ++i) covariance(i, i) = kFeatureFloor[i] * kFeatureFloor[i];
  for (const ShapeFeatures& look : looks) {
    const auto deviation = (look.cast<double>() - mean).eval();
    covariance += deviation * deviation.transpose() / static_cast<double>(looks.size());
  }
  const Eigen::LLT<Covariance> root(covariance);
  const Covariance lower = root.matrixL();
  Prototype prototype;
  prototype.mean = mean.cast<float>();
  prototype.whitening = lower.inverse().cast<float>();
  prototype.density = static_cast<float>(std::exp(kLogVolumeScale - lower.diagonal().array().log().sum()));
  return prototype;
}

Eigen::Vector2f mean_of(const std::vector<Eigen::Vector2f>& points) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  for (const Eigen::Vector2f& point : points) sum += point;
  return points.empty() ? sum : (sum / static_cast<float>(points.size())).eval();
}

}  // namespace

int margin_px(int spacing_px, float camera_px_per_projector_px) {
  return std::clamp(static_cast<int>(0.5F * static_cast<float>(spacing_px) * camera_px_per_projector_px), 1, 2);
}

float threshold_level(int spacing_px, float camera_px_per_projector_px) {
  constexpr float kWideGapPx = 2.2F;
  return static_cast<float>(spacing_px) * camera_px_per_projector_px >= kWideGapPx ? 0.3F : 0.45F;
}

std::vector<Prototype> make_prototypes(const PrototypeOptions& options) {
  return std::move(make_prototypes(options, std::span(&options.frame_error, 1)).front());
}

std::vector<std::vector<Prototype>> make_prototypes(const PrototypeOptions& options,
                                                    std::span<const float> frame_errors) {
  std::vector<std::vector<Prototype>> prototypes(frame_errors.size());
  const auto size_px = static_cast<float>(options.symbol_size_px);
  Regions regions;
  SymbolViewer viewer({options.symbols, options.symbol_size_px, options.spacing_px, options.camera_px_per_projector_px,
                       threshold_level(options.spacing_px, options.camera_px_per_projector_px)});
  for (std::size_t letter = 0; letter < options.symbols.size(); ++letter) {
    std::vector<std::vector<ShapeFeatures>> looks(frame_errors.size());
    std::vector<Eigen::Vector2f> centroids;
    for (int sample = 0; sample < options.samples; ++sample) {
      const SymbolView& tilted = viewer.view(static_cast<int>(letter), 1);
      const FrameError error = viewer.frame_error();
      if (const auto look = look_at(tilted, options, regions)) {
        for (std::size_t i = 0; i < frame_errors.size(); ++i) {
          const LatticeFrame assumed = tilted.frame * error.of_size(frame_errors[i]);
          looks[i].push_back(shape_features(look->moments, assumed.inverse(), size_px));
        }
      }
      const SymbolView& upright = viewer.view(static_cast<int>(letter), 0);
      (void)viewer.frame_error();  // as for the tilted one, so that both see the same numbers of the series
      if (const auto look = look_at(upright, options, regions)) centroids.push_back(look->centroid_px);
    }
    for (std::size_t i = 0; i < frame_errors.size(); ++i) {
      prototypes[i].push_back(summarise(looks[i]));
      prototypes[i].back().centroid_px = mean_of(centroids);
    }
  }
  return prototypes;
}

}  // namespace slsd
