// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbols/prototypes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/code/symbol.hpp"
#include "core/decode/regions/separate_regions.hpp"
#include "core/decode/symbols/grey_moments.hpp"
#include "core/decode/symbols/symbol_view.hpp"
#include "core/regions/find_regions.hpp"

namespace slsd {
namespace {

/// Effects that the model leaves out (uneven light, curvature, texture), as a standard deviation of each feature. They
/// give every direction a minimum uncertainty.
constexpr double kFeatureFloor[kFeatureCount] = {0.02, 0.003, 0.003, 0.003, 0.0008, 0.0006, 0.0006, 0.0008};

/// Scales the densities to the middle of the float range.
constexpr double kLogVolumeScale = -40;

struct Look {
  GreyMoments moments;
  Eigen::Vector2f centroid_px, steady_centroid_px;
  bool whole;  ///< no other region in its cell
};

/// Smallest difference between light and dark at which regions are split, of 255 levels.
constexpr float kGapContrastMin = 8;

/// Reads views as the decoder does.
/// @thread thread-bound: keeps its buffers
class Observer {
 public:
  explicit Observer(const PrototypeOptions& options)
      : cell_px_(static_cast<float>(options.symbol_size_px + options.spacing_px)),
        symbol_px_(static_cast<float>(options.symbol_size_px) * options.camera_px_per_projector_px),
        separator_({.tile_px = threshold_tile_px(options.symbol_size_px + options.spacing_px,
                                                 options.camera_px_per_projector_px)}),
        meter_(margin_px(options.spacing_px, options.camera_px_per_projector_px)) {}

  /// The region nearest to the middle of the view.
  std::optional<Look> look_at(const SymbolView& view) {
    finder_.find(Mask(view.mask.view()), regions_);
    return measure(view);
  }
  /// Reads a view again after splitting what ran together in the last look.
  std::optional<Look> look_closer(const SymbolView& view) {
    const float reach = reach_px(view);
    separator_.separate_all(view.image.view(), kGapContrastMin, regions_, [&](const Region& region) {
      return static_cast<float>(std::max(region.width_px(), region.height_px())) > 2 * reach;
    });
    return measure(view);
  }

 private:
  [[nodiscard]] float reach_px(const SymbolView& view) const {
    return 0.6F * view.frame.colwise().norm().maxCoeff() * cell_px_ + 1;
  }
  std::optional<Look> measure(const SymbolView& view) {
    const Eigen::Vector2f middle = Eigen::Vector2f::Constant(0.5F * static_cast<float>(view.image.width() - 1));
    const Eigen::Matrix2f inverse = view.frame.inverse();
    const Region* nearest = nullptr;
    float nearest_px = 0.5F * symbol_px_;
    int in_the_cell = 0;
    for (const Region& region : regions_.regions) {
      const float distance_px = (region.middle_px() - middle).norm();
      if (distance_px < nearest_px) nearest = &region, nearest_px = distance_px;
      in_the_cell += (inverse * (region.middle_px() - view.middle_px)).cwiseAbs().maxCoeff() < 0.42F * cell_px_;
    }
    if (nearest == nullptr) return std::nullopt;
    const Eigen::Array2f low(nearest->left, nearest->top), high(nearest->right, nearest->bottom);
    if ((middle.array() - low).max(high - middle.array()).maxCoeff() > reach_px(view)) return std::nullopt;
    const GreyMoments moments =
        meter_.measure(view.image.view(), *nearest, regions_.runs_of(*nearest), SteadyCentre::kMeasured);
    const Eigen::Vector2f centroid = Eigen::Vector2f(moments.x, moments.y) - view.middle_px,
                          steady_centroid = Eigen::Vector2f(moments.steady_x, moments.steady_y) - view.middle_px;
    return Look{moments, inverse * centroid, inverse * steady_centroid, in_the_cell == 1};
  }

  float cell_px_, symbol_px_;  // projector px; camera px
  RegionFinder finder_;
  RegionSeparator separator_;
  GreyMomentMeter meter_;
  Regions regions_;
};

SymbolSpread spread_of(const std::vector<ShapeFeatures>& looks) {
  SymbolSpread spread{.mean = decltype(spread.mean)::Zero(), .covariance = FeatureCovariance::Zero(), .lost = 0};
  for (const ShapeFeatures& look : looks) spread.mean += look.cast<double>() / static_cast<double>(looks.size());
  for (int i = 0; i < kFeatureCount; ++i) spread.covariance(i, i) = kFeatureFloor[i] * kFeatureFloor[i];
  for (const ShapeFeatures& look : looks) {
    const auto deviation = (look.cast<double>() - spread.mean).eval();
    spread.covariance += deviation * deviation.transpose() / static_cast<double>(looks.size());
  }
  return spread;
}

Prototype prototype_of(const SymbolSpread& spread) {
  const Eigen::LLT<FeatureCovariance> root(spread.covariance);
  const FeatureCovariance lower = root.matrixL();
  Prototype prototype;
  prototype.mean = spread.mean.cast<float>();
  prototype.whitening = lower.inverse().cast<float>();
  prototype.density = static_cast<float>(std::exp(kLogVolumeScale - lower.diagonal().array().log().sum()));
  return prototype;
}

SymbolViewer viewer_of(const PrototypeOptions& options, bool drawn) {
  return SymbolViewer({options.symbols, options.symbol_size_px, options.spacing_px, options.camera_px_per_projector_px,
                       threshold_level(options.symbol_size_px, options.spacing_px, options.camera_px_per_projector_px),
                       options.noise, drawn});
}

Eigen::Vector2f mean_of(const std::vector<Eigen::Vector2f>& points) {
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  for (const Eigen::Vector2f& point : points) sum += point;
  return points.empty() ? sum : (sum / static_cast<float>(points.size())).eval();
}

/// Looks at one letter in one blur.
class LooksOfLetter {
 public:
  explicit LooksOfLetter(std::size_t frame_errors) : shapes_(frame_errors) {}

  void add_tilted(const Look& look, const LatticeFrame& frame, const FrameError& error,
                  std::span<const float> frame_errors, float symbol_size_px) {
    for (std::size_t i = 0; i < frame_errors.size(); ++i) {
      const LatticeFrame assumed = frame * error.of_size(frame_errors[i]);
      shapes_[i].push_back(shape_features(look.moments, assumed.inverse(), symbol_size_px));
    }
  }
  void add_upright(const Look& look) {
    centroids_.push_back(look.centroid_px);
    steady_centroids_.push_back(look.steady_centroid_px);
  }
  [[nodiscard]] Prototype prototype(std::size_t frame_error) const {
    Prototype prototype = prototype_of(spread_of(shapes_[frame_error]));
    prototype.centroid_px = mean_of(centroids_);
    prototype.steady_centroid_px = mean_of(steady_centroids_);
    return prototype;
  }

 private:
  std::vector<std::vector<ShapeFeatures>> shapes_;  // by error of the local frame
  std::vector<Eigen::Vector2f> centroids_, steady_centroids_;
};

}  // namespace

int margin_px(int spacing_px, float camera_px_per_projector_px) {
  return std::clamp(static_cast<int>(0.5F * static_cast<float>(spacing_px) * camera_px_per_projector_px), 1, 2);
}

int threshold_tile_px(int pitch_px, float camera_px_per_projector_px) {
  const float half_px = 0.5F * static_cast<float>(pitch_px) * camera_px_per_projector_px;
  return std::clamp(static_cast<int>(std::lround(half_px)), 4, 64);
}

float threshold_level(int symbol_size_px, int spacing_px, float camera_px_per_projector_px) {
  constexpr float kWideGapPx = 2.2F, kLargeSymbolPx = 16;
  if (static_cast<float>(spacing_px) * camera_px_per_projector_px < kWideGapPx) return 0.45F;
  return static_cast<float>(symbol_size_px) * camera_px_per_projector_px < kLargeSymbolPx ? 0.3F : 0.25F;
}

std::vector<SymbolSpread> spread_of_symbols(const PrototypeOptions& options) {
  std::vector<SymbolSpread> spreads;
  Observer observer(options);
  SymbolViewer viewer = viewer_of(options, is_drawn(options.blur_px));
  for (std::size_t letter = 0; letter < options.symbols.size(); ++letter) {
    std::vector<ShapeFeatures> looks;
    int lost = 0;
    for (int sample = 0; sample < options.samples; ++sample) {
      viewer.expose(static_cast<int>(letter), 1);
      const SymbolView& view = viewer.develop(options.blur_px);
      const LatticeFrame assumed = view.frame * viewer.frame_error().of_size(options.frame_error);
      const auto look = observer.look_at(view);
      if (look && look->whole) {
        looks.push_back(shape_features(look->moments, assumed.inverse(), static_cast<float>(options.symbol_size_px)));
      } else {
        const auto closer = observer.look_closer(view);
        lost += !closer || !closer->whole;
      }
    }
    spreads.push_back(spread_of(looks));
    spreads.back().lost = static_cast<double>(lost) / options.samples;
  }
  return spreads;
}

std::vector<Prototype> make_prototypes(const PrototypeOptions& options) {
  return std::move(make_prototypes(options, std::span(&options.frame_error, 1)).front());
}

PrototypeSets make_prototypes(const PrototypeOptions& options, std::span<const float> frame_errors) {
  return std::move(make_prototypes(options, frame_errors, std::span(&options.blur_px, 1)).front());
}

std::vector<PrototypeSets> make_prototypes(const PrototypeOptions& options, std::span<const float> frame_errors,
                                           std::span<const std::optional<float>> blurs_px) {
  const bool drawn = !blurs_px.empty() && is_drawn(blurs_px.front());
  assert(std::ranges::all_of(blurs_px, [&](const auto& blur_px) { return is_drawn(blur_px) == drawn; }));
  std::vector<PrototypeSets> prototypes(blurs_px.size(), PrototypeSets(frame_errors.size()));
  const auto size_px = static_cast<float>(options.symbol_size_px);
  Observer observer(options);
  SymbolViewer viewer = viewer_of(options, drawn);
  for (int letter = 0; letter < static_cast<int>(options.symbols.size()); ++letter) {
    std::vector<LooksOfLetter> looks(blurs_px.size(), LooksOfLetter(frame_errors.size()));
    for (int sample = 0; sample < options.samples; ++sample) {
      viewer.expose(letter, 1);
      const FrameError error = viewer.frame_error();
      for (std::size_t blur = 0; blur < blurs_px.size(); ++blur) {
        const SymbolView& tilted = viewer.develop(blurs_px[blur]);
        if (const auto look = observer.look_at(tilted))
          looks[blur].add_tilted(*look, tilted.frame, error, frame_errors, size_px);
      }
      viewer.expose(letter, 0);
      (void)viewer.frame_error();  // also for the untilted view, so that both use the same random numbers
      for (std::size_t blur = 0; blur < blurs_px.size(); ++blur)
        if (const auto look = observer.look_at(viewer.develop(blurs_px[blur]))) looks[blur].add_upright(*look);
    }
    for (std::size_t blur = 0; blur < blurs_px.size(); ++blur)
      for (std::size_t i = 0; i < frame_errors.size(); ++i) prototypes[blur][i].push_back(looks[blur].prototype(i));
  }
  return prototypes;
}

}  // namespace slsd
