// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/calibrate/observe/observations.hpp"
#include "programs/calibrate/session/guide/board_place.hpp"
#include "programs/calibrate/session/guide/board_view.hpp"

namespace slsd {

/// The poses of a session so far, and what is missing.
/// @thread thread-bound
class PoseCollection {
 public:
  /// @param so_far  with every camera's name; with sizes if poses were read from a record
  /// @param subject  what the poses show; others are skipped
  PoseCollection(const Board& board, const Observations& so_far, PoseSubject subject = PoseSubject::kBoard);

  /// The sizes of the cameras' pictures, in their order.
  /// @errors kMismatch: the poses so far have another size
  [[nodiscard]] Result<> set_sizes(const std::vector<GreyImage>& pictures);

  void add(PoseObservation pose);
  [[nodiscard]] const Observations& observations() const { return observations_; }
  [[nodiscard]] std::size_t size() const { return observations_.poses.size(); }
  [[nodiscard]] PoseSubject subject() const { return subject_; }

  /// The earlier pose with the same view of the board in every camera that sees it now; empty if there is none.
  [[nodiscard]] std::string same_as(const BoardSightings& sightings) const;
  /// The median blur of a camera's views, px; 0 below three views.
  [[nodiscard]] double usual_blur_px(std::size_t camera) const;
  /// The most helpful advice for the next pose: "tilt the board ...".
  [[nodiscard]] std::string most_helpful() const;

 private:
  using Places = std::map<std::size_t, BoardPlace>;  // by camera
  [[nodiscard]] std::string missing_tilt() const;
  [[nodiscard]] std::string missing_place(double enough) const;
  [[nodiscard]] std::string missing_distance() const;
  [[nodiscard]] std::string next_place_of_plane() const;

  Board board_;
  PoseSubject subject_;
  Observations observations_;
  std::vector<Places> places_;  // one for each pose
};

}  // namespace slsd
