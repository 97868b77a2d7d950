// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/observe_pose.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/calibrate/observe/board_region.hpp"
#include "core/calibrate/observe/gray_code.hpp"
#include "core/calibrate/observe/print_shift.hpp"
#include "core/calibrate/observe/symbol_gap.hpp"
#include "core/exposure/divide_light.hpp"

namespace slsd {
namespace {

/// Number of regions of symbol size above which a pattern is visible, though a different one.
constexpr std::size_t kPatternRegions = 60;
/// Number of symbols above which the pattern is certain: fewer among so many shapes may agree by chance.
constexpr std::size_t kSymbolsCertain = 20;

/// Keeps only the board and its vicinity. Where the projector lights nothing, the quotient is that of two noises, as
/// bright as the pattern. The reader would count it as the frame's noise.
void clear_surroundings(const BoardRegion& region, Grey16& quotient) {
  for (int y = 0; y < quotient.height(); ++y) {
    for (int x = 0; x < quotient.width(); ++x) {
      if (!region.is_near({x, y})) quotient.at(x, y) = 0;
    }
  }
}

std::string why_no_symbols(std::size_t shapes) {
  if (shapes > kPatternRegions) {
    return fmt::format(
        "{} shapes are visible, but not those of the configured pattern: the projected pattern or the projector's size "
        "differs",
        shapes);
  }
  return "the board shows nothing of the projected pattern; light it with the projector, in focus, without clipping";
}

}  // namespace

Result<PoseView> observe_board(const PosePictures& pictures, const Board& board, BoardSighting& sighting) {
  auto found = find_board(pictures.white, board);
  if (!found) return tl::unexpected(found.error());
  sighting = std::move(*found);
  PoseView view;
  view.blur_px = sighting.edge_px;
  view.clipped_share = std::max(sighting.full_share, full_share_of_print(pictures.white, board, sighting));
  for (const SeenPoint& point : sighting.points) {
    view.corners.push_back({point.pixel, board.point(point.id).head<2>()});
  }
  return view;
}

Result<> observe_pattern(const PosePictures& pictures, const Board& board, const BoardSighting& sighting,
                         PatternReader& reader, PoseView& view) {
  const PrintShift shift = find_print_shift(pictures.white, pictures.coded.at(0), board, sighting);
  if (shift.certain()) view.shift_px = shift.px;
  const BoardRegion region(board, sighting);
  auto levelled = divide_light(pictures.coded.at(0), pictures.white,
                               PrintedSurface{[&](int x, int y) {
                                                return region.contains({x, y});
                                              },
                                              sighting.edge_px});
  if (!levelled) return tl::unexpected(levelled.error());
  clear_surroundings(region, levelled->quotient);
  auto matches = reader.read(levelled->quotient.view(), levelled->noise);
  if (!matches) return tl::unexpected(matches.error());
  std::erase_if(*matches, [&](const SymbolMatch& match) { return !region.contains(match.camera_px); });
  if (matches->size() < kSymbolsCertain && reader.shapes() > kPatternRegions) matches->clear();
  if (matches->empty()) return fail(ErrorCode::kNotFound, why_no_symbols(reader.shapes()));
  for (const SymbolMatch& match : *matches)
    view.symbols.push_back({match.camera_px, match.projector_px, match.sigma_px});
  const SymbolGap gap = find_symbol_gap(*matches, reader.pattern(), region, pictures.white);
  view.hidden_symbols = gap.symbols, view.hidden_clipped = gap.clipped;
  return {};
}

Result<> observe_gray_code(const PosePictures& pictures, const Board& board, const BoardSighting& sighting,
                           const ImageSize& projector, PoseView& view) {
  if (!pictures.black) return fail(ErrorCode::kNotFound, "a Gray code also needs a picture under the black projector");
  const BoardRegion region(board, sighting);
  auto points = read_gray_code({pictures.white, *pictures.black, pictures.coded}, projector, [&](int x, int y) {
    return region.contains({x, y});
  });
  if (!points) return tl::unexpected(points.error());
  view.symbols = std::move(*points);
  if (view.symbols.empty()) {
    return fail(ErrorCode::kNotFound, "the Gray code cannot be read on the board; lower the exposure if it is clipped");
  }
  return {};
}

}  // namespace slsd
