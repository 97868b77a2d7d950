// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/decode/centres/align_symbols.hpp"
#include "core/decode/symbol_reader.hpp"
#include "core/exposure/divide_light.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/geometry/epipolar/epipolar_limit.hpp"
#include "core/geometry/triangulator.hpp"
#include "core/image_size.hpp"

namespace slsd {
namespace {

/// Cells around a part that must be decoded for its symbols to be those of the whole frame. A symbol's place depends on
/// bends over two cells, averaged with its neighbours' (three cells); the symbols there on their 3x3 windows (four),
/// and these on the links of their outermost symbols (five). Of 6017 symbols in 40 parts of a frame of a plane, 135
/// differ in their last digits with four cells, and none with five or more. On seven frames of the corpus, two, three,
/// four and six cells give the same number of points within 0.2 %.
constexpr float kCellsAround = 5;

}  // namespace

/// A copy is for another thread.
struct Decoder::Parts {
  CalibratedCamera camera;
  std::uint8_t camera_index;
  DecodeOptions options;
  SymbolReader reader;
  EpipolarView view;
  Triangulator triangulator;
  std::optional<SymbolAligner> aligner;  // for precision "fine"
  HeldFullLevel full_level{};
  Decoding decoding{};
  std::vector<PixelRay> rays{};  // rays of the symbols to align, and their depths
  std::vector<double> depths_mm{};
  const std::vector<AlignedSymbol>* aligned = nullptr;  // symbols of this frame
  std::vector<TriangulatedPoint> solutions{};           // one for each symbol
  bool are_solved = false;                              // the solutions are those of this frame's symbols

  const Lattice* lattice_read = nullptr;  // lattice of this frame

  void solve(const std::vector<LatticeSymbol>& symbols, Executor& executor);
  void place_symbols(Executor& executor);
  void triangulate(const Lattice& lattice, double full, Executor& executor);
  void add_point(const LatticeSymbol& symbol, const Eigen::Vector2f& centre_px, const TriangulatedPoint& solved,
                 double full);
};

Decoder::Decoder(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<Decoder> Decoder::create(const IndexedPattern& indexed, const Calibration& calibration, std::size_t camera_index,
                                const DecodeOptions& options, const Decoder* earlier) {
  if (auto valid = options.validate(); !valid) return tl::unexpected(valid.error());
  if (camera_index >= calibration.cameras.size()) {
    return fail(ErrorCode::kInvalidArgument, "the calibration has no camera " + std::to_string(camera_index));
  }
  const Pattern& pattern = indexed.pattern();
  const CalibratedCamera& camera = calibration.cameras[camera_index];
  if (auto fits = check_image_size(camera.lens.width_px, camera.lens.height_px); !fits) {
    return fail(fits.error().code, fits.error().message, "camera " + camera.name);
  }
  const Lens& projector = calibration.projector;
  if (projector.width_px != pattern.options.projector_width_px ||
      projector.height_px != pattern.options.projector_height_px) {
    return fail(ErrorCode::kMismatch,
                "the calibration is for a projector of " + size_text(projector.width_px, projector.height_px) +
                    " pixels, but the pattern is for " +
                    size_text(pattern.options.projector_width_px, pattern.options.projector_height_px) +
                    "; calibrate with this projector, or set the projector's size to the calibrated one");
  }
  std::optional<PaperWay> paper;
  if (options.any_paper()) {
    auto created = PaperWay::create(indexed);
    if (!created) return tl::unexpected(created.error());
    paper = std::move(*created);
  }
  ExpectedFrames expected(camera, projector, options.middle_depth_mm());
  return Decoder(std::make_unique<Parts>(
      Parts{.camera = camera,
            .camera_index = static_cast<std::uint8_t>(camera_index),
            .options = options,
            .reader = SymbolReader(indexed, projector, std::move(expected), options, std::move(paper),
                                   earlier != nullptr ? earlier->parts_->reader.appearances() : nullptr),
            .view = EpipolarView(camera, projector, options.depth_min_mm, options.depth_max_mm,
                                 epipolar_gate_px(calibration.report.epipolar_error_px)),
            .triangulator = Triangulator(camera, projector),
            .aligner = options.precision == Precision::kFine
                           ? std::optional<SymbolAligner>(std::in_place, pattern, camera, projector)
                           : std::nullopt}));
}

Decoder Decoder::another() const {
  auto parts = std::make_unique<Parts>(*parts_);
  parts->lattice_read = nullptr;
  return Decoder(std::move(parts));
}

std::uint8_t Decoder::camera_index() const {
  return parts_->camera_index;
}

void Decoder::set_part(const std::optional<PixelRectangle>& part) {
  const auto around_px = static_cast<int>(std::lround(
      kCellsAround * static_cast<float>(parts_->reader.pattern().pitch_px()) * parts_->reader.expected_scale()));
  const bool has_pixels = part && !part->empty();
  parts_->reader.set_part(has_pixels ? part->widened(around_px, parts_->camera.lens) : part);
}

Result<> Decoder::check_size(const GreyView& frame) const {
  const auto [width, height] = size_of(frame);
  const Lens& lens = parts_->camera.lens;
  if (width == lens.width_px && height == lens.height_px) return {};
  return fail(ErrorCode::kMismatch, "the frame has " + size_text(width, height) +
                                        " pixels, but the camera was calibrated with " +
                                        size_text(lens.width_px, lens.height_px) +
                                        "; set the camera to the calibrated size, or calibrate again");
}

Result<const Decoding*> Decoder::decode(const GreyView& frame, std::optional<double> full, StageObserver* observer,
                                        Executor* executor) {
  SerialExecutor alone;
  Executor& shared = executor != nullptr ? *executor : alone;
  if (auto same = check_size(frame); !same) return tl::unexpected(same.error());
  const double level = full ? *full : parts_->full_level.of(frame);
  const Lattice& lattice = parts_->reader.read(frame, level, &parts_->view, shared, observer);
  parts_->lattice_read = &lattice, parts_->are_solved = false;
  if (parts_->aligner) {
    parts_->place_symbols(shared);
    parts_->aligned = &parts_->aligner->align(frame, level, parts_->reader.noise(), lattice, parts_->rays,
                                              parts_->depths_mm, parts_->reader.cells());
    if (observer != nullptr) observer->stage_done(Stage::kAlign);
  }
  parts_->triangulate(lattice, level, shared);
  parts_->reader.list_off_line(parts_->decoding.off_line);
  parts_->reader.report(parts_->decoding);
  parts_->decoding.light = symbol_light(lattice, level, parts_->reader.edge_blur_px());
  if (observer != nullptr) observer->stage_done(Stage::kTriangulate);
  return &parts_->decoding;
}

void Decoder::Parts::solve(const std::vector<LatticeSymbol>& symbols, Executor& executor) {
  solutions.resize(symbols.size());
  executor.run_ranges(
      symbols.size(),
      [&](std::size_t first, std::size_t last, int) {
        RayMatches matches;
        for (std::size_t i = first; i < last; ++i) {
          const LatticeSymbol& symbol = symbols[i];
          matches.set(i - first, view.ray_near(symbol.sighting, symbol.centre_px),
                      reader.cells().ray(symbol.row, symbol.column).direction, symbol.sigma_px);
        }
        triangulator.triangulate(matches, std::span(solutions).subspan(first, last - first));
      },
      PixelRays::kAtOnce);
}

DecodedSymbols Decoder::symbols(Executor& executor) {
  static const Lattice kNone;
  if (parts_->lattice_read == nullptr) return {&kNone, {}, {}, {}};
  parts_->place_symbols(executor);
  return {parts_->lattice_read, parts_->rays, parts_->depths_mm, parts_->reader.noise()};
}

void Decoder::Parts::place_symbols(Executor& executor) {
  const std::vector<LatticeSymbol>& symbols = lattice_read->symbols;
  if (!are_solved) solve(symbols, executor);
  rays.resize(symbols.size()), depths_mm.resize(symbols.size());
  executor.run_ranges(symbols.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      rays[i] = view.ray_near(symbols[i].sighting, symbols[i].centre_px);
      const double depth = solutions[i].point_in_camera.z();
      depths_mm[i] = depth > 0 ? depth : options.depth_max_mm;
    }
  });
}

void Decoder::Parts::triangulate(const Lattice& lattice, double full, Executor& executor) {
  const bool gated = options.correspond == Method::kDefault;
  const Rules rules(options.trial);
  if (aligner) {
    solutions.clear();
    for (const AlignedSymbol& symbol : *aligned) solutions.push_back({symbol.point_in_camera, symbol.sigma_mm});
  } else {
    solve(lattice.symbols, executor);
    are_solved = true;
  }
  decoding.points.clear();
  for (std::size_t i = 0; i < lattice.symbols.size(); ++i) {
    const LatticeSymbol& symbol = lattice.symbols[i];
    if (rules.apply(DecodeRule::kNotAligned, aligner && !(*aligned)[i].whole)) {
      reader.reject(symbol, DecodeRule::kNotAligned);
      continue;
    }
    const TriangulatedPoint& point = solutions[i];
    const double depth = point.point_in_camera.z();
    const bool in_range = gated ? depth >= options.depth_min_mm && depth <= options.depth_max_mm : depth > 0;
    if (point.point_in_camera.allFinite() && !rules.apply(DecodeRule::kPointOutOfRange, !in_range)) {
      add_point(symbol, aligner ? (*aligned)[i].centre_px : symbol.centre_px, point, full);
    } else {
      reader.reject(symbol, DecodeRule::kPointOutOfRange);
    }
  }
}

void Decoder::Parts::add_point(const LatticeSymbol& symbol, const Eigen::Vector2f& centre_px,
                               const TriangulatedPoint& solved, double full) {
  const Eigen::Vector3f point = (camera.rig_from_camera * solved.point_in_camera).cast<float>();
  const Eigen::Vector2f projector = reader.cells().pixel(symbol.row, symbol.column).cast<float>();
  const float level_of_255 = static_cast<float>(full / 255);
  CloudPoint& out = decoding.points.emplace_back();
  out.x = point.x(), out.y = point.y(), out.z = point.z();
  out.camera_u = centre_px.x(), out.camera_v = centre_px.y();
  out.projector_u = projector.x(), out.projector_v = projector.y();
  out.sigma_mm = static_cast<float>(solved.sigma_mm);
  out.column = static_cast<std::uint16_t>(symbol.column), out.row = static_cast<std::uint16_t>(symbol.row);
  out.intensity = static_cast<std::uint8_t>(std::clamp((symbol.background + symbol.gain) / level_of_255, 0.F, 255.F));
  out.camera = camera_index;
  const Pattern& pattern = reader.pattern();
  out.symbol = static_cast<std::uint8_t>(pattern.options.symbols[pattern.array.at(symbol.row, symbol.column)]);
}

Result<const Decoding*> decode_in_light(Decoder& decoder, const GreyView& frame, const SceneLight& light,
                                        StageObserver* observer, Executor* executor) {
  auto plain = decoder.decode(frame, light.full, observer, executor);
  if (!plain || !light.white) return plain;
  const std::size_t points = (*plain)->points.size();
  const auto quotient = divide_light(frame, *light.white, light.dark);
  if (!quotient) return tl::unexpected(quotient.error());
  auto divided = decoder.decode(quotient->view(), kQuotientFull, observer, executor);
  if (!divided || (*divided)->points.size() >= points) return divided;
  return decoder.decode(frame, light.full, observer, executor);
}

}  // namespace slsd
