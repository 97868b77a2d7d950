// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/paper_way.hpp"

#include <algorithm>

#include "core/paper/decode_windows.hpp"

namespace slsd {
namespace {

/// Classifies as the letter that the thresholds name, with near certainty; without a letter, as no symbol at all.
Classification certain(int letter, int letters) {
  Classification shape;
  shape.letter = static_cast<std::int8_t>(letter);
  constexpr float kCertain = -0.01F, kOther = -6;
  for (int i = 0; i < letters; ++i) shape.log_probability[i] = i == letter ? kCertain : kOther;
  return shape;
}

Grey8 mask_of(const Region& region, std::span<const Run> runs) {
  Grey8 mask(region.width_px(), region.height_px());
  for (const Run& run : runs)
    std::fill_n(mask.row(run.row - region.top) + run.left - region.left, run.right - run.left, 1);
  return mask;
}

}  // namespace

PaperWay::PaperWay(const IndexedPattern& indexed, std::vector<LetterThresholds> thresholds)
    : pattern_(indexed),
      thresholds_(std::move(thresholds)),
      grid_(make_paper_grid(indexed.pattern().options.symbols, indexed.pattern().options.symbol_size_px,
                            indexed.pattern().options.spacing_px)) {}

Result<PaperWay> PaperWay::create(const IndexedPattern& indexed) {
  const Pattern& pattern = indexed.pattern();
  auto thresholds = make_thresholds(pattern.options.symbols, pattern.options.symbol_size_px);
  if (!thresholds) return tl::unexpected(thresholds.error());
  return PaperWay(indexed, std::move(*thresholds));
}

void PaperWay::describe(const Regions& regions, Sightings& seen, Method centre) {
  described_.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Region& region = regions.regions[seen.region[i]];
    described_[i].shape = describe_shape(mask_of(region, regions.runs_of(region)));
    Eigen::Vector2d& centroid_px = described_[i].shape.centroid_px;
    centroid_px += Eigen::Vector2d(region.left, region.top);
    if (centre == Method::kDefault) continue;
    seen.moments[i].x = static_cast<float>(centroid_px.x());
    seen.moments[i].y = static_cast<float>(centroid_px.y());
  }
}

void PaperWay::classify(float side_px, Sightings& seen) const {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen.shapes[i] = certain(classify_paper(described_[i].shape, thresholds_, side_px), pattern_.pattern().letters());
  }
}

void PaperWay::link_grid(const Regions& regions, int width_px, int height_px, Sightings& seen) {
  labels_ = Image<std::int32_t>(width_px, height_px, -1);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    described_[i].letter = seen.shapes[i].letter;
    for (const Run& run : regions.runs_of(regions.regions[seen.region[i]])) {
      std::fill(labels_.row(run.row) + run.left, labels_.row(run.row) + run.right, static_cast<std::int32_t>(i));
    }
  }
  const std::vector<Links> links = link_grid_paper(described_, labels_, grid_);
  for (std::size_t i = 0; i < seen.size(); ++i) seen.nodes[i].links = links[i];
}

void PaperWay::decode_windows(int rows, int columns, Sightings& seen) const {
  std::vector<int> letters;
  std::vector<Links> links;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    letters.push_back(seen.shapes[i].letter);
    links.push_back(seen.nodes[i].links);
  }
  const auto cells = decode_windows_paper(letters, links, *pattern_.array());
  seen.claims.assign(seen.size(), {});
  for (std::size_t i = 0; i < seen.size(); ++i) {
    CellClaim& claim = seen.claims[i];
    claim.decide(letters[i] < 0 ? DecodeRule::kNoLetter : DecodeRule::kNoWindow);
    if (!cells[i] || cells[i]->row >= rows || cells[i]->column >= columns) continue;
    claim = {static_cast<std::int16_t>(cells[i]->row), static_cast<std::int16_t>(cells[i]->column)};
    claim.decide(DecodeRule::kCertain);
  }
}

}  // namespace slsd
