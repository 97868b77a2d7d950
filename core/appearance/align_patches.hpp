// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <span>

#include "core/appearance/patch_task.hpp"
#include "core/appearance/pattern_field.hpp"
#include "core/image.hpp"

namespace slsd {

/// Fetches the part of the field that the windows need into the cache, for a later align_eight().
void fetch_windows(const PatternField& field, int window_px, std::span<const PatchTask* const> tasks);

/// Aligns windows of the frame with the pattern by least squares of
///
///     I(x, y) = (gain + gain_x x + gain_y y) P(p(x, y)) + offset
///
/// with P the blurred pattern, by one step of Gauss and Newton (Lucas and Kanade 1981; Baker and Matthews 2004). Pixels
/// far off the last step's result count less. Takes up to eight windows of the same size, one in each lane: no
/// operation crosses lanes, and the eight systems of equations are solved at once. Ignores bends.
/// @param full       the level of a saturated pixel, see Censored
/// @param window_px  odd: side of the windows, which lie within the frame
/// @thread reentrant
void align_eight(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 int window_px, std::span<PatchTask* const> tasks);

/// Aligns any number of cells by the same equations, in options.steps steps. Takes the bends as given. A task that
/// fails keeps the state before the step that failed.
/// @param tasks  in any order; the quickest if neighbours have windows of one size
/// @thread reentrant
void align_cells(const GreyView& frame, double full, const PatternField& field, const AlignOptions& options,
                 std::span<CellTask> tasks);

}  // namespace slsd
