// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/model/places/align.hpp"
#include "clients/model/places/shot.hpp"
#include "core/geometry/calibration.hpp"

namespace slsd::model {

/// Votes of other shots on a cell's place.
struct CellEvidence {
  std::uint8_t agree = 0;    ///< shots that measured a surface there
  std::uint8_t alike = 0;    ///< shots that measured one there that is marked itself
  std::uint8_t through = 0;  ///< shots that saw something behind it: the place was empty
  std::uint8_t silent = 0;   ///< shots that looked at it from its front and measured nothing around it
};

/// Evidence on each cell of the finest level, for each view of a shot.
using ShotEvidence = std::vector<std::vector<CellEvidence>>;

/// No evidence yet.
[[nodiscard]] ShotEvidence no_evidence(const Shot& shot);

/// Adds what a witness says. @thread reentrant
void weigh(ShotEvidence& evidence, const PlacedShot& shot, const PlacedShot& witness);

/// Shares of an object's cells in one shot that another should see in their place and does not.
struct MissingShares {
  double through = 0;  ///< it saw what is behind them
  double silent = 0;   ///< it saw nothing there
};

/// Both are close to 0 if the places are right. @thread reentrant
[[nodiscard]] MissingShares missing_shares(const PlacedShot& shot, const PlacedShot& witness);

/// Marks the cells that do not move with the object, such as those of a hand: their places are empty in other shots.
/// Silence alone marks none, as dark and shaded surfaces are silent, too. It decides beside cells that light passed.
/// @return     how many cells of the finest level are marked
/// @thread     reentrant
std::size_t mark_foreign(Shot& shot, const ShotEvidence& evidence);

/// Finds more: what is connected to marked cells, and which only those shots confirm that show the same foreign body in
/// the same place.
/// @param witnesses  other shots
/// @return           for each view, the cells to mark
/// @thread           reentrant
[[nodiscard]] std::vector<std::vector<std::size_t>> grown_foreign(const PlacedShot& shot,
                                                                  std::span<const PlacedShot> witnesses);

/// Marks the coarse cells of which half is marked at the finest level; unmarks the others.
void mark_coarse_cells(Shot& shot);

/// Drops the pixels of marked cells. @param images  those that the shot was made of
void drop_foreign(std::vector<RangeImage>& images, const Shot& shot);

}  // namespace slsd::model
