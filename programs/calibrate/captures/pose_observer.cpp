// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/pose_observer.hpp"

#include <string>

#include "core/calibrate/judge/view_demands.hpp"

namespace slsd {

PoseObserver::PoseObserver(const Board& board, const IndexedPattern& pattern, const ImageSize& projector,
                           bool gray_code)
    : board_(board), pattern_(pattern), projector_(projector), gray_code_(gray_code) {}

Result<PoseView> PoseObserver::observe(std::size_t camera, const PosePictures& pictures) {
  BoardSighting sighting;
  auto view = observe_board(pictures, board_, sighting);
  if (const auto other = rows_by_columns(board_); !view && !seen_ && other) {
    if (auto turned = observe_board(pictures, *other, sighting)) view = std::move(turned), board_ = *other;
  }
  if (!view) return view;
  seen_ = true;
  view->camera = camera;
  const auto read = gray_code_ ? observe_gray_code(pictures, board_, sighting, projector_, *view)
                               : observe_pattern(pictures, board_, sighting,
                                                 readers_.try_emplace(camera, pattern_).first->second, *view);
  if (read) return view;
  // An overexposed board is unreadable; this reports that as the reason.
  const std::string light = excess_of_light(view->clipped_share);
  return light.empty() ? tl::unexpected(read.error()) : fail(ErrorCode::kNotFound, light);
}

PrintShift PoseObserver::print_shift(const GreyView& white, const GreyView& pattern) const {
  const auto sighting = find_board(white, board_);
  return sighting ? find_print_shift(white, pattern, board_, *sighting) : PrintShift{};
}

PoseObservers make_observers(const Board& board, const std::optional<Board>& plane, const IndexedPattern& pattern,
                             const ImageSize& projector, bool gray_code) {
  PoseObservers observers{PoseObserver(board, pattern, projector, gray_code), std::nullopt};
  if (plane) observers.plane.emplace(*plane, pattern, projector, gray_code);
  return observers;
}

}  // namespace slsd
