// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "programs/calibrate/captures/captured_pictures.hpp"
#include "programs/calibrate/captures/pose_collection.hpp"
#include "programs/calibrate/captures/pose_observer.hpp"
#include "programs/calibrate/session/guide/board_view.hpp"
#include "programs/calibrate/session/pose_source.hpp"

namespace slsd {

/// An attempted pose.
struct PoseTrial {
  std::vector<PoseView> views;             ///< one for each camera that saw enough; empty: the pose is refused
  std::vector<CapturedPictures> pictures;  ///< one for each camera
  std::vector<std::string> lacks;          ///< reasons why a camera's view does not count, one sentence each
  std::vector<std::string> advice;         ///< possible improvements
  std::chrono::nanoseconds work{};         ///< computing time, without waits for devices

  [[nodiscard]] bool refused() const { return views.empty(); }
  /// The reasons in one line.
  [[nodiscard]] std::string why() const;
};

/// Takes a pose: the pattern or a Gray code, then white again to check that the board was held still.
/// @thread thread-bound
class PoseTaker {
 public:
  /// @param images  in the projector's size: the pattern alone, or the Gray code, which also needs black
  PoseTaker(PoseSource& source, PoseObserver& observer, std::vector<Grey8> images, bool gray_code);

  /// Shows white light and looks at the board. @errors of PoseSource::grab()
  [[nodiscard]] Result<BoardView> look();

  /// @param before  a look() at the board, held still
  /// @param taken   the poses so far, as a reference for blur
  /// @errors of PoseSource::grab()
  [[nodiscard]] Result<PoseTrial> take(BoardView before, const PoseCollection& taken);

 private:
  [[nodiscard]] Result<std::vector<GreyImage>> grab_under(const Grey8& image);
  [[nodiscard]] Result<> project(std::vector<CapturedPictures>& pictures);
  [[nodiscard]] Result<PoseView> judge(std::size_t camera, const Result<BoardSighting>& sighting,
                                       const CapturedPictures& pictures, double usual_blur_px);

  PoseSource& source_;
  PoseObserver& observer_;
  std::vector<Grey8> images_;
  bool gray_code_;
  Grey8 white_, black_;
};

}  // namespace slsd
