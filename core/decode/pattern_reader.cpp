// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/pattern_reader.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/decode/symbol_reader.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

/// Scales to try, camera px per projector px, in this order around 1.
constexpr double kScaleMin = 0.35, kScaleMax = 16, kScaleStep = 1.3;
/// Size of symbols in the camera from which on the frame is shrunk, and the smallest size that shrinking leaves them.
constexpr double kLargePx = 48, kLargeEnoughPx = 24;
/// Number of rotations of the pattern in the camera's image to try, over a full turn.
constexpr int kTurns = 12;
/// A scale is likely if shapes of a symbol's size cover at least this fraction (1 / kFewOfMany) of the area at the best
/// scale: specks are many, but small.
constexpr double kFewOfMany = 4;
/// Numbers of symbols on one plane that do not agree by chance. In a frame of another pattern, some in a hundred are
/// read, scattered everywhere.
constexpr std::size_t kCertain = 40, kLeast = 12;
/// Share of the symbols that must lie within this fraction of a cell from the place that the plane of the others
/// predicts.
constexpr double kAgreeingShare = 0.6, kAgreeingCells = 0.6;
/// Wrong cells that a frame may have: cells that agree with a plane are kept, and the bundle adjustment rejects the
/// rest.
constexpr double kWrongCellsMax = 0.075;
/// Largest ratio to the scale that a reader was made for, at which it is still used.
constexpr double kSameScale = 1.12;

/// Makes a substitute for the projector's lens while there is no calibration; the cells' pixels do not depend on it.
Lens any_lens(const PatternOptions& options) {
  return {.width_px = options.projector_width_px,
          .height_px = options.projector_height_px,
          .fx = static_cast<double>(options.projector_width_px),
          .fy = static_cast<double>(options.projector_width_px)};
}

/// 1, 1/step, step, 1/step^2, ...
std::vector<double> scales_to_try() {
  std::vector<double> scales{1};
  for (double scale = kScaleStep; scale < kScaleMax; scale *= kScaleStep) {
    if (1 / scale > kScaleMin) scales.push_back(1 / scale);
    scales.push_back(scale);
  }
  return scales;
}

Homography turned_and_scaled(double angle, double scale) {
  Homography homography;
  homography.matrix.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  homography.matrix.topLeftCorner<2, 2>() *= scale;
  return homography;
}

/// Means over squares of pixels; leaves out incomplete squares at the right and at the bottom.
template <class T>
Image<T> shrink(const ImageView<T>& frame, int factor) {
  Image<T> small(frame.width / factor, frame.height / factor);
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(small.width()));
  const auto pixels = static_cast<std::uint32_t>(factor * factor);
  for (int y = 0; y < small.height(); ++y) {
    std::ranges::fill(sums, pixels / 2);
    for (int row = y * factor; row < (y + 1) * factor; ++row) {
      const T* from = frame.row(row);
      for (std::uint32_t& sum : sums)
        for (int i = 0; i < factor; ++i) sum += *from++;
    }
    std::ranges::transform(sums, small.row(y), [&](std::uint32_t sum) { return static_cast<T>(sum / pixels); });
  }
  return small;
}

Homography homography_of(const std::vector<SymbolMatch>& matches) {
  std::vector<Eigen::Vector2d> from, to;
  for (const SymbolMatch& match : matches) from.push_back(match.projector_px), to.push_back(match.camera_px);
  return fit_robust_homography(from, to);
}

bool lie_on_one_plane(const std::vector<SymbolMatch>& matches, double pitch_px) {
  if (matches.size() < kLeast) return false;
  const Homography projector_from_camera = homography_of(matches).inverse();
  const auto agrees = [&](const SymbolMatch& match) {
    return (projector_from_camera.map(match.camera_px) - match.projector_px).norm() < kAgreeingCells * pitch_px;
  };
  const auto agreeing = static_cast<double>(std::ranges::count_if(matches, agrees));
  return agreeing >= kAgreeingShare * static_cast<double>(matches.size());
}

}  // namespace

struct PatternReader::Trial {
  SymbolReader reader;
  double scale;

  Trial(const IndexedPattern& pattern, ExpectedFrames frames)
      : reader(pattern, any_lens(pattern.pattern().options), std::move(frames), {.wrong_cells_max = kWrongCellsMax},
               std::nullopt),
        scale(reader.expected_scale()) {}
};

PatternReader::PatternReader(IndexedPattern pattern) : pattern_(std::move(pattern)) {}
PatternReader::PatternReader(PatternReader&&) noexcept = default;
PatternReader& PatternReader::operator=(PatternReader&&) noexcept = default;
PatternReader::~PatternReader() = default;

PatternReader::Shrunk PatternReader::frame_for(double scale, const GreyView& frame) {
  const double symbol_px = pattern().options.symbol_size_px * scale;
  const auto [width, height] = size_of(frame);
  const int factor = std::min(static_cast<int>(symbol_px / kLargeEnoughPx), std::min(width, height));
  if (symbol_px <= kLargePx || factor <= 1) return {frame, 1};
  const auto placed = shrunk_.try_emplace(factor);
  auto& shrunk = placed.first->second;
  if (placed.second) std::visit([&](const auto& view) { shrunk = shrink(view, factor); }, frame);
  return {std::visit([](const auto& image) { return GreyView(image.view()); }, shrunk), factor};
}

std::optional<FrameNoise> PatternReader::noise_of(const Shrunk& frame) const {
  if (!noise_) return std::nullopt;
  return noise_->scaled(1, 1 / static_cast<float>(frame.factor));
}

std::vector<SymbolMatch> PatternReader::attempt(const Homography& camera_from_projector, const GreyView& whole,
                                                bool is_there) {
  const auto [whole_width, whole_height] = size_of(whole);
  const Shrunk shrunk =
      frame_for(ExpectedFrames(camera_from_projector.matrix, whole_width, whole_height).in_the_middle().scale, whole);
  const auto& [frame, factor] = shrunk;
  const auto [width, height] = size_of(frame);
  Eigen::Matrix3d shrinking = Eigen::Matrix3d::Identity();
  const double middle = 0.5 * (factor - 1);  // offset of a square's centre from its first pixel
  shrinking.topLeftCorner<2, 2>() /= factor;
  shrinking.topRightCorner<2, 1>().setConstant(-middle / factor);
  ExpectedFrames frames(shrinking * camera_from_projector.matrix, width, height);
  const double scale = frames.in_the_middle().scale;
  auto at = std::ranges::find_if(trials_, [&](const auto& trial) {
    return scale < kSameScale * trial->scale && trial->scale < kSameScale * scale;
  });
  if (at == trials_.end()) {
    trials_.push_back(std::make_unique<Trial>(pattern_, std::move(frames)));
    at = trials_.end() - 1;
  } else {
    (*at)->reader.expect(std::move(frames));
  }
  std::vector<SymbolMatch> matches = (*at)->reader.read_anywhere(frame, full_, noise_of(shrunk), is_there);
  for (SymbolMatch& match : matches) {
    match.camera_px = factor * match.camera_px.array() + middle;
    match.sigma_px *= factor;
  }
  shapes_ = std::max(shapes_, (*at)->reader.shapes());
  return matches;
}

/// Finds the scales at which shapes of a symbol's size cover enough pixels compared with the best scale. Prototypes are
/// made for these alone.
std::vector<double> PatternReader::likely_scales(const GreyView& whole) {
  const std::vector<double> scales = scales_to_try();
  std::vector<double> lit_px;
  std::vector<std::size_t> shapes;
  Sightings seen;
  for (const double scale : scales) {
    const Shrunk shrunk = frame_for(scale, whole);
    const auto& [frame, factor] = shrunk;
    const auto [width, height] = size_of(frame);
    ShapeFinder finder(pattern().options, ExpectedFrames(turned_and_scaled(0, scale / factor).matrix, width, height),
                       Method::kDefault, Method::kDefault);
    SerialExecutor alone;
    const GreyView sharp = finder.binarize(frame, full_, alone, noise_of(shrunk));
    finder.find_regions(sharp, alone);
    finder.describe(sharp, alone, seen);
    shapes.push_back(seen.size());
    double sum = 0;
    for (const GreyMoments& moments : seen.moments) sum += static_cast<double>(moments.weight);
    lit_px.push_back(sum * factor * factor);
  }
  shapes_ = std::max(shapes_, std::ranges::max(shapes));
  const double enough = std::ranges::max(lit_px) / kFewOfMany;
  std::vector<double> likely;
  for (std::size_t i = 0; i < scales.size(); ++i) {
    if (shapes[i] >= kLeast && lit_px[i] >= enough) likely.push_back(scales[i]);
  }
  return likely;
}

/// Searches with the camera upright, then at every rotation.
std::vector<SymbolMatch> PatternReader::search(const GreyView& frame) {
  std::vector<SymbolMatch> best;
  const auto found_at = [&](double angle, double scale) {
    std::vector<SymbolMatch> matches = attempt(turned_and_scaled(angle, scale), frame, false);
    const bool better = matches.size() > best.size() && lie_on_one_plane(matches, pattern().pitch_px());
    if (better) best = std::move(matches);
    return best.size() >= kCertain;
  };
  const std::vector<double> scales = likely_scales(frame);
  for (int turn = 0; turn < kTurns; ++turn) {
    for (const double scale : scales) {
      if (found_at(2 * std::numbers::pi * turn / kTurns, scale)) return best;
    }
  }
  return best;
}

/// Repeats with the frames that the found symbols show, until no more are found.
std::vector<SymbolMatch> PatternReader::refine(std::vector<SymbolMatch> found, const GreyView& frame) {
  constexpr int kRounds = 3;
  constexpr double kWorthwhile = 1.03;
  for (int round = 0; round < kRounds && found.size() >= kCertain; ++round) {
    last_ = homography_of(found);
    auto again = attempt(*last_, frame, true);
    const bool grows = static_cast<double>(again.size()) > kWorthwhile * static_cast<double>(found.size());
    if (again.size() >= found.size()) found = std::move(again);
    if (!grows) break;
  }
  return found;
}

Result<std::vector<SymbolMatch>> PatternReader::read(const GreyView& frame, const std::optional<FrameNoise>& noise) {
  const auto [width, height] = size_of(frame);
  if (auto fits = check_image_size(width, height); !fits) return tl::unexpected(fits.error());
  std::vector<SymbolMatch> found;
  shapes_ = 0, noise_ = noise;
  full_ = full_level_.of(frame);
  shrunk_.clear();
  if (last_) found = attempt(*last_, frame, true);
  if (found.size() < kCertain || !lie_on_one_plane(found, pattern().pitch_px())) found = search(frame);
  return refine(std::move(found), frame);
}

}  // namespace slsd
