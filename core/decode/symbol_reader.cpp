// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_reader.hpp"

#include <Eigen/LU>

#include "core/decode/centre_sigma.hpp"
#include "core/decode/correspond.hpp"

namespace slsd {
namespace {

/// How far frames are off: the calibration's expectation by the tilt of the surface, a measured one by noise and
/// curvature.
constexpr float kExpectedFrameError = 0.15F;
constexpr float kMeasuredFrameError = 0.05F;
/// Standard deviations from the nearest prototype beyond which a shape is none of the pattern's.
constexpr float kExpectedDistanceMax = 25;
constexpr float kMeasuredDistanceMax = 20;
/// A shape this near to its prototype, and this much likelier than any other, need not be looked at in the measured
/// frame.
constexpr float kDecidedDistance = 3;
constexpr float kDecidedLogProbability = -0.01F;

/// The centroids that the estimator in use finds: the paper's are those of the symbols as they are drawn.
std::vector<Prototype> with_centroids_of(Method centre, const Pattern& pattern, std::vector<Prototype> prototypes) {
  if (centre == Method::kDefault) return prototypes;
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    const Descriptors drawn = describe_shape(draw_symbol(pattern.options.symbols[i], pattern.options.symbol_size_px));
    const double middle = 0.5 * (pattern.options.symbol_size_px - 1);
    prototypes[i].centroid_px = (drawn.centroid_px.array() - middle).cast<float>();
  }
  return prototypes;
}

/// Errors that the array's distance corrects; more than one costs more memory than it gains.
int radius_of(const CodeArray& array) {
  return array.minimum_distance >= 3 ? 1 : 0;
}

}  // namespace

SymbolReader::Prototypes SymbolReader::prototypes_for(const Pattern& pattern, float scale) {
  constexpr float kFrameErrors[] = {kExpectedFrameError, kMeasuredFrameError};
  auto made = make_prototypes(
      {pattern.options.symbols, pattern.options.symbol_size_px, pattern.options.spacing_px, scale}, kFrameErrors);
  return {std::move(made[0]), std::move(made[1])};
}

SymbolReader::SymbolReader(const Pattern& pattern, ExpectedFrames expected, const DecodeOptions& options,
                           std::optional<PaperWay> paper)
    : SymbolReader(prototypes_for(pattern, expected.in_the_middle().scale), pattern, std::move(expected), options,
                   std::move(paper)) {}

SymbolReader::SymbolReader(Prototypes prototypes, const Pattern& pattern, ExpectedFrames&& expected,
                           const DecodeOptions& options, std::optional<PaperWay>&& paper)
    : pattern_(pattern),
      options_(options),
      paper_(std::move(paper)),
      shapes_(pattern.options, std::move(expected), options.binarize, options.find_regions),
      prototypes_(std::move(prototypes)),
      classifier_as_expected_(prototypes_.as_expected, kExpectedDistanceMax),
      classifier_as_measured_(prototypes_.as_measured, kMeasuredDistanceMax),
      linker_({.pitch_px = static_cast<float>(pattern.pitch_px())}),
      window_decoder_(pattern, {.rows = pattern.whole_rows(), .columns = pattern.whole_columns()},
                      radius_of(pattern.array)),
      review_(pattern, prototypes_.as_measured, {}),
      centre_correction_(prototypes_.as_measured, static_cast<float>(pattern.pitch_px()),
                         static_cast<float>(pattern.options.symbol_size_px)) {}

CellRays SymbolReader::cell_rays(const Lens& projector) const {
  return {pattern_, with_centroids_of(options_.centre, pattern_, prototypes_.as_measured), projector};
}

void SymbolReader::describe(const GreyView& frame) {
  shapes_.describe(frame, seen_);
  if (paper_) paper_->describe(shapes_.regions(), seen_);
  if (options_.centre == Method::kPaper) paper_->centre(seen_);
}

void SymbolReader::classify() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  seen_.shapes.resize(seen_.size());
  seen_.nodes.assign(seen_.size(), {});
  if (options_.classify == Method::kPaper) paper_->classify(size * expected_scale(), seen_);
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const GreyMoments& moments = seen_.moments[i];
    GridNode& node = seen_.nodes[i];
    const ExpectedFrame& expected = shapes_.expected().at(moments.x, moments.y);
    node.frame = expected.frame;
    node.centre_px = {moments.x, moments.y};
    if (options_.classify == Method::kDefault) {
      seen_.shapes[i] = classifier_as_expected_.classify(shape_features(moments, expected.inverse, size));
    }
    if (seen_.shapes[i].letter >= 0)
      node.centre_px -= node.frame * prototypes_.as_expected[seen_.shapes[i].letter].centroid_px;
  }
}

void SymbolReader::link_grid() {
  if (options_.link_grid == Method::kPaper)
    return paper_->link_grid(shapes_.regions(), shapes_.mask().width(), shapes_.mask().height(), seen_);
  linker_.link(seen_.nodes);
  if (options_.classify == Method::kDefault) classify_in_measured_frames();
}

void SymbolReader::classify_in_measured_frames() {
  const float size = static_cast<float>(pattern_.options.symbol_size_px);
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const GridNode& node = seen_.nodes[i];
    const Classification& before = seen_.shapes[i];
    const bool decided = before.letter >= 0 && before.distance < kDecidedDistance &&
                         before.log_probability[before.letter] > kDecidedLogProbability;
    if (decided || !node.measured_u || !node.measured_v) continue;
    seen_.shapes[i] = classifier_as_measured_.classify(shape_features(seen_.moments[i], node.frame.inverse(), size));
  }
}

bool SymbolReader::reviews() const {
  return options_.classify == Method::kDefault && options_.centre == Method::kDefault &&
         options_.decode_windows == Method::kDefault;
}

void SymbolReader::decode_windows(const GreyView& frame, const CellGate& gate) {
  if (options_.decode_windows == Method::kPaper) {
    return paper_->decode_windows(pattern_.whole_rows(), pattern_.whole_columns(), seen_);
  }
  window_decoder_.decode(seen_.nodes, seen_.shapes, gate, seen_.claims);
  if (reviews()) review_.review(frame, shapes_.regions(), linker_, shapes_.meter(), seen_);
}

const std::vector<Eigen::Vector2f>& SymbolReader::find_centres() {
  letters_.resize(seen_.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const CellClaim& claim = seen_.claims[i];
    letters_[i] = static_cast<std::int8_t>(claim.named() ? pattern_.array.at(claim.row, claim.column) : -1);
  }
  if (options_.centre == Method::kPaper) {
    centres_.resize(seen_.size());
    for (std::size_t i = 0; i < seen_.size(); ++i) centres_[i] = {seen_.moments[i].x, seen_.moments[i].y};
  } else {
    centre_correction_.correct(seen_.nodes, seen_.moments, seen_.claims, letters_, centres_);
  }
  return centres_;
}

std::vector<SymbolMatch> SymbolReader::read_anywhere(const GreyView& frame, double full, const CellRays& cells) {
  binarize(frame, full);
  find_regions(frame);
  describe(frame);
  std::vector<SymbolMatch> matches;
  if (seen_.size() == 0) return matches;
  classify();
  link_grid();
  decode_windows(frame, CellGate(cells, {}, 0));
  Correspondence({}).settle_duplicates(cells, seen_.claims);
  const std::vector<Eigen::Vector2f>& centres = find_centres();
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const CellClaim& claim = seen_.claims[i];
    if (claim.status != RegionStatus::kDecoded) continue;
    matches.push_back(
        {centres[i].cast<double>(), cells.pixel(claim.row, claim.column), centre_sigma_px(seen_.moments[i])});
  }
  return matches;
}

void SymbolReader::report(Decoding& decoding) const {
  const std::vector<Region>& regions = shapes_.regions().regions;
  decoding.regions.resize(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    decoding.regions[i] = {regions[i].middle_px(), shapes_.status(i), -1, {-1, -1, -1, -1}, {}, -1, -1};
  }
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    RegionSeen& out = decoding.regions[seen_.region[i]];
    const GridNode& node = seen_.nodes[i];
    out.centre_px = {seen_.moments[i].x, seen_.moments[i].y};
    out.status = seen_.claims[i].status;
    out.letter = seen_.shapes[i].letter;
    for (int d = 0; d < 4; ++d) out.links[d] = node.links[d] < 0 ? -1 : seen_.region[node.links[d]];
    out.broken = node.broken;
    if (out.status == RegionStatus::kDecoded) out.column = seen_.claims[i].column, out.row = seen_.claims[i].row;
  }
  decoding.counts = {};
  for (const RegionSeen& region : decoding.regions) ++decoding.counts[static_cast<std::size_t>(region.status)];
}

}  // namespace slsd
