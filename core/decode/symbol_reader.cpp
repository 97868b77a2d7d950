// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/symbol_reader.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <Eigen/LU>

#include "core/decode/centres/centre_sigma.hpp"
#include "core/geometry/robust.hpp"
#include "core/lanes.hpp"

namespace slsd {
namespace {

/// A shape this near to its prototype, and this much likelier than any other letter, needs no second look in the
/// measured frame.
constexpr float kDecidedDistance = 3;
constexpr float kDecidedLogProbability = -0.01F;

/// Prototypes with the centroids that the current estimator finds: the paper's are those of the drawn symbols.
std::vector<Prototype> with_centroids_of(Method centre, const Pattern& pattern, std::vector<Prototype> prototypes) {
  if (centre == Method::kDefault) return prototypes;
  for (std::size_t i = 0; i < prototypes.size(); ++i) {
    const Descriptors drawn = describe_shape(draw_symbol(pattern.options.symbols[i], pattern.options.symbol_size_px));
    const double middle = 0.5 * (pattern.options.symbol_size_px - 1);
    prototypes[i].centroid_px = (drawn.centroid_px.array() - middle).cast<float>();
  }
  return prototypes;
}

}  // namespace

SymbolReader::Fixed::Fixed(const IndexedPattern& shown, const Lens& projector, Method centre,
                           std::shared_ptr<const Appearances> looks)
    : pattern(shown),
      appearances(std::move(looks)),
      cells(shown.pattern(), with_centroids_of(centre, shown.pattern(), appearances->usual().as_measured), projector) {}

SymbolReader::SymbolReader(const IndexedPattern& indexed, const Lens& projector, ExpectedFrames expected,
                           const DecodeOptions& options, std::optional<PaperWay> paper,
                           std::shared_ptr<const Appearances> known)
    : options_(options),
      fixed_(std::make_shared<const Fixed>(
          indexed, projector, options.centre,
          Appearances::shared(indexed.pattern().options, expected.in_the_middle().scale, std::move(known)))),
      paper_(std::move(paper)),
      finder_(pattern().options, std::move(expected), options.binarize, options.find_regions, Rules(options.trial)),
      linker_({.pitch_px = static_cast<float>(pattern().pitch_px())}),
      inference_(pattern(), indexed.codebook(), options.wrong_cells_max, Rules(options.trial)),
      review_(indexed, {.rules = Rules(options.trial)}),
      letters_(std::make_shared<const LetterFields>(pattern().options)),
      recovery_(indexed, letters_, Rules(options.trial)),
      correspondence_(Rules(options.trial)),
      centre_correction_(fixed_->appearances->usual().as_measured, static_cast<float>(pattern().pitch_px()),
                         static_cast<float>(pattern().options.symbol_size_px)) {}

const Lattice& SymbolReader::read(const GreyView& frame, double full, EpipolarView* view, Executor& executor,
                                  StageObserver* observer) {
  const auto done = [&](Stage stage) {
    if (observer != nullptr) observer->stage_done(stage);
  };
  const GreyView sharp = finder_.binarize(frame, full, executor, known_noise_);
  done(Stage::kBinarize);
  finder_.find_regions(sharp, executor), done(Stage::kFindRegions);
  finder_.describe(sharp, executor, seen_);
  if (paper_) paper_->describe(finder_.regions(), seen_, options_.centre);
  done(Stage::kDescribe);
  classify(executor), done(Stage::kClassify);
  link_grid(executor), done(Stage::kLinkGrid);
  if (view != nullptr) view->look_at(seen_, executor);
  infer_cells(sharp, view, executor), done(Stage::kDecodeWindows);
  review(sharp, executor), done(Stage::kReview);
  correspond(view, executor);
  fit_lattice(frame, full, view, executor), done(Stage::kCorrespond);
  return lattice_;
}

/// Measures the look of symbols in this frame, from a sample whose neighbours show their local frames.
void SymbolReader::measure_look() {
  constexpr std::size_t kSamples = 200;
  const float size = static_cast<float>(pattern().options.symbol_size_px);
  sample_.clear();
  const std::size_t step = std::max<std::size_t>(1, seen_.size() / kSamples);
  for (std::size_t i = step / 2; i < seen_.size(); i += step) {
    const GridNode& node = seen_.nodes[i];
    if (!node.measured_u || !node.measured_v) continue;
    sample_.push_back(shape_features(seen_.moments[i], node.frame.inverse(), size));
  }
  look_ = &fixed_->appearances->likeliest(sample_);
}

void SymbolReader::classify(Executor& executor) {
  look_ = &fixed_->appearances->usual();
  const float size = static_cast<float>(pattern().options.symbol_size_px);
  seen_.shapes.resize(seen_.size());
  seen_.nodes.assign(seen_.size(), {});
  if (options_.classify == Method::kPaper) paper_->classify(size * expected_scale(), seen_);
  executor.run_ranges(seen_.size(), [&](std::size_t first, std::size_t last, int) {
    EightMoments eight;
    EightShapes shapes;
    for (std::size_t i = first; i < last; ++i) {
      const GreyMoments& moments = seen_.moments[i];
      GridNode& node = seen_.nodes[i];
      const ExpectedFrame& expected = finder_.expected().at(moments.x, moments.y);
      node.frame = expected.frame;
      node.centre_px = {moments.x, moments.y};
      if (options_.classify != Method::kDefault) continue;
      const std::size_t lane = (i - first) % kLanes;
      eight.set(static_cast<int>(lane), moments, expected.inverse);
      if (lane + 1 == kLanes || i + 1 == last) {
        find_features(eight, size, shapes);
        look_->expected.classify(shapes, std::span(seen_.shapes).subspan(i - lane, lane + 1));
      }
    }
    for (std::size_t i = first; i < last; ++i) {
      GridNode& node = seen_.nodes[i];
      node.split = seen_.shapes[i].is_split();
      if (seen_.shapes[i].letter >= 0)
        node.centre_px -= node.frame * look_->as_expected[seen_.shapes[i].letter].centroid_px;
    }
  });
}

void SymbolReader::link_grid(Executor& executor) {
  if (options_.link_grid == Method::kPaper)
    return paper_->link_grid(finder_.regions(), finder_.mask().width(), finder_.mask().height(), seen_);
  linker_.link(seen_.nodes, executor);
  if (is_there_) measure_look();
  if (options_.classify == Method::kDefault) classify_in_measured_frames(executor);
}

void SymbolReader::classify_in_measured_frames(Executor& executor) {
  const float size = static_cast<float>(pattern().options.symbol_size_px);
  executor.run_ranges(seen_.size(), [&](std::size_t first, std::size_t last, int) {
    for (std::size_t i = first; i < last; ++i) {
      const GridNode& node = seen_.nodes[i];
      const Classification& before = seen_.shapes[i];
      const bool decided = before.letter >= 0 && before.distance < kDecidedDistance &&
                           before.log_probability[before.letter] > kDecidedLogProbability;
      if (decided || !node.measured_u || !node.measured_v) continue;
      seen_.shapes[i] = look_->measured.classify(shape_features(seen_.moments[i], node.frame.inverse(), size));
    }
  });
}

/// Infers the cells, and recovers degraded symbols in between, so that these become evidence too.
void SymbolReader::infer_cells(const GreyView& frame, EpipolarView* view, Executor& executor) {
  if (options_.decode_windows == Method::kPaper) {
    paper_->decode_windows(pattern().whole_rows(), pattern().whole_columns(), seen_);
    seen_.aligned.assign(seen_.size(), Aligned::kNot);
    return;
  }
  const CellGate gate = gate_of(view);
  inference_.propose(gate, executor, seen_);
  recover(frame, gate, view, executor);
  inference_.decide(gate, executor, seen_);
}

CellGate SymbolReader::gate_of(const EpipolarView* view) const {
  if (view == nullptr || options_.correspond != Method::kDefault) return {cells(), {}, 0};
  return {cells(), view->segments(), view->tolerance_px()};
}

float SymbolReader::blur_px() const {
  return look_->blur_px.value_or(expected_scale()) / expected_scale();
}

/// Requires the default method in all stages.
void SymbolReader::recover(const GreyView& frame, const CellGate& gate, EpipolarView* view, Executor& executor) {
  if (options_.any_paper()) return;
  const LetterScene scene{
      frame, 255.0 * finder_.frame_levels(), finder_.noise(), letters_->at(blur_px()), gate, look_->as_measured, seen_};
  const std::vector<std::int32_t>& recovered = recovery_.recover(scene, executor);
  if (view == nullptr) return;
  for (const std::int32_t sighting : recovered) view->look_again_at(sighting, seen_);
}

void SymbolReader::review(const GreyView& frame, Executor& executor) {
  const bool paper_before = options_.classify == Method::kPaper || options_.centre == Method::kPaper ||
                            options_.decode_windows == Method::kPaper;
  if (!paper_before)
    review_.review(frame, finder_.regions(), linker_, {look_->as_measured, look_->measured}, finder_.meters(), executor,
                   seen_);
}

void SymbolReader::correspond(const EpipolarView* view, Executor& executor) {
  if (view == nullptr) {
    correspondence_.settle_duplicates(cells(), seen_.claims);
  } else if (options_.correspond == Method::kDefault) {
    correspondence_.correspond(cells(), view->segments(), view->tolerance_px(), executor, seen_.claims);
  }
}

void SymbolReader::fit_lattice(const GreyView& frame, double full, const EpipolarView* view, Executor& executor) {
  centre_correction_.correct(seen_.nodes, seen_.moments, seen_.claims, pattern().array, executor, lattice_,
                             seen_.misfits);
  // The paper has no correction, and aligned symbols need none.
  for (LatticeSymbol& symbol : lattice_.symbols) {
    if (options_.centre == Method::kDefault && !is_aligned(seen_.aligned[symbol.sighting])) continue;
    const GreyMoments& moments = seen_.moments[symbol.sighting];
    symbol.centre_px = {moments.x, moments.y};
  }
  noise_ = finder_.noise();
  centre_judge_.judge(noise_, view, cells(), executor, lattice_);
  refuse_cut();
  const float scale = static_cast<float>(full / 255) / finder_.frame_levels();
  if (scale == 1) return;
  // Sharpening adds noise; from here on, use the frame's own.
  for (LatticeSymbol& symbol : lattice_.symbols) symbol.background *= scale, symbol.gain *= scale;
  noise_ = measure_noise(frame, full);
}

/// Rejects symbols that an edge cuts. The rest of one may still resemble it, but its centre is displaced. At a
/// boundary, this rejects symbols whose error is an order larger than the median.
void SymbolReader::refuse_cut() {
  constexpr float kOfMedian = 13;
  std::vector<LatticeSymbol>& symbols = lattice_.symbols;
  const float limit = kOfMedian * usual_of(symbols.size(), [&](std::size_t i) { return symbols[i].damage_px; });
  kept_.clear();
  std::int32_t count = 0;
  for (const LatticeSymbol& symbol : symbols) {
    const bool is_at_rim = std::ranges::find(symbol.neighbours, -1) != symbol.neighbours.end();
    const bool is_cut = Rules(options_.trial).apply(DecodeRule::kCutCentre, symbol.damage_px > limit && is_at_rim);
    kept_.push_back(is_cut ? -1 : count++);
    if (is_cut) reject(symbol, DecodeRule::kCutCentre);
  }
  if (count == static_cast<std::int32_t>(symbols.size())) return;
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    if (kept_[i] < 0) continue;
    LatticeSymbol& symbol = symbols[static_cast<std::size_t>(kept_[i])] = symbols[i];
    for (std::int32_t& other : symbol.neighbours) other = other < 0 ? -1 : kept_[static_cast<std::size_t>(other)];
  }
  symbols.erase(symbols.begin() + count, symbols.end());
}

std::vector<SymbolMatch> SymbolReader::read_anywhere(const GreyView& frame, double full,
                                                     const std::optional<FrameNoise>& noise, bool is_there) {
  std::vector<SymbolMatch> matches;
  is_there_ = is_there, known_noise_ = noise;
  SerialExecutor alone;
  for (const LatticeSymbol& symbol : read(frame, full, nullptr, alone).symbols) {
    matches.push_back({symbol.centre_px.cast<double>(), cells().pixel(symbol.row, symbol.column), symbol.sigma_px});
  }
  return matches;
}

void SymbolReader::list_off_line(std::vector<SymbolMatch>& matches) const {
  matches.clear();
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const CellClaim& claim = seen_.claims[i];
    if (claim.status != RegionStatus::kOffEpipolarLine || !claim.named()) continue;
    const GreyMoments& m = seen_.moments[i];
    matches.push_back({{m.x, m.y},
                       cells().pixel(claim.row, claim.column),
                       noise_of_centre_px(m.weight, m.background, m.peak - m.background, finder_.noise())});
  }
}

void SymbolReader::report(Decoding& decoding) const {
  const std::vector<Region>& regions = finder_.regions().regions;
  decoding.regions.resize(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const DecodeRule rule = finder_.rule(i);
    decoding.regions[i] = {regions[i].middle_px(), text_of(rule).gives, -1, {-1, -1, -1, -1}, {}, -1, -1, rule};
  }
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    RegionSeen& out = decoding.regions[seen_.region[i]];
    const GridNode& node = seen_.nodes[i];
    out.centre_px = {seen_.moments[i].x, seen_.moments[i].y};
    const CellClaim& claim = seen_.claims[i];
    out.status = claim.status, out.rule = claim.rule, out.margin_nats = claim.margin_nats;
    if (out.status != RegionStatus::kDecoded && claim.guard != DecodeRule::kCertain) out.guard = claim.guard;
    out.letter = seen_.shapes[i].letter;
    for (int d = 0; d < 4; ++d) out.links[d] = node.links[d] < 0 ? -1 : seen_.region[node.links[d]];
    out.broken = node.broken;
    if (out.status == RegionStatus::kDecoded) out.column = claim.column, out.row = claim.row;
  }
  decoding.counts = {}, decoding.rules = {};
  for (const RegionSeen& region : decoding.regions) {
    ++decoding.counts[static_cast<std::size_t>(region.status)];
    ++decoding.rules[static_cast<std::size_t>(region.rule)];
    if (region.guard) ++decoding.rules[static_cast<std::size_t>(*region.guard)];
  }
}

}  // namespace slsd
