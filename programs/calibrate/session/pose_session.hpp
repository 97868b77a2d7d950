// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "programs/calibrate/captures/pose_collection.hpp"
#include "programs/calibrate/session/guide/session_terminal.hpp"
#include "programs/calibrate/session/guide/sign.hpp"
#include "programs/calibrate/session/pose_recorder.hpp"
#include "programs/calibrate/session/pose_source.hpp"
#include "programs/calibrate/session/pose_taker.hpp"
#include "programs/latency/timepiece.hpp"

namespace slsd {

struct PoseSessionOptions {
  std::size_t poses = 12;                         ///< number at which the session ends, including earlier poses
  std::chrono::milliseconds sign{500};            ///< how long a sign is shown
  std::chrono::milliseconds after_refusal{2000};  ///< pause before another attempt with the same board
  std::chrono::seconds timeout{60};      ///< time until advice without a board; or until the end without the devices
  std::chrono::milliseconds retry{500};  ///< pause between two attempts with failing devices
  bool begun = false;                    ///< the devices have given a picture before, so timeout applies at once
};

/// The progress of a session, for displays other than a terminal.
struct PoseProgress {
  std::string_view state;  ///< "no board", "moving", "still", "done", "hold", "taken" or "again"
  std::string text;        ///< reason for refusing a pose; else empty
  std::size_t wanted = 0;
  const PoseCollection& poses;
  const BoardSightings& sightings;
};

/// The objects that a session works with; each must outlive it.
struct PoseSessionParts {
  PoseSource& source;
  PoseTaker& taker;
  PoseRecorder& recorder;
  PoseCollection& poses;
  SessionTerminal& terminal;
  Timepiece time;
  std::function<bool()> interrupted;
  std::function<void(const PoseProgress&)> progress = [](const PoseProgress&) {};
};

/// Takes poses of a board that a person holds, without any key:
///
///     white ---> board seen, still for two views ---> "hold" ---> white, pattern, white ---> kept, "taken"
///       ^  \-> not seen, moves                |                          \-> refused, "again"
///       |                                     \-> as an earlier pose, "again"          |
///       \------------------------------------------------------------------------------/
///
/// @thread thread-bound
class PoseSession {
 public:
  PoseSession(PoseSessionParts parts, const PoseSessionOptions& options);

  /// Runs the session until there are enough poses, or until an interrupt.
  /// @errors of the recorder; of the devices: at once if they never start, else after their timeout; kMismatch: the
  ///         cameras differ from those of the earlier poses
  [[nodiscard]] Result<> run();

 private:
  [[nodiscard]] Result<> step();
  [[nodiscard]] Result<> bear(const Error& error);
  void watch_for_board(const BoardSightings& sightings);
  void show_state(const BoardSightings& sightings, double moved);
  [[nodiscard]] Result<> attempt(const BoardSightings& sightings);
  [[nodiscard]] Result<> keep(PoseTrial trial, BoardSightings sightings);
  void refuse(const std::string& why);
  void show(Sign sign, const std::string& why = {});

  PoseSessionParts parts_;
  PoseSessionOptions options_;
  BoardSightings last_;                    // of the previous view
  std::optional<BoardSightings> handled_;  // those that need no new attempt until the board moves
  MonotonicTime next_attempt_{};
  MonotonicTime tell_at_{};                  // time for advice that no board was seen for long
  std::optional<MonotonicTime> bear_until_;  // set while the devices fail
  bool begun_;                               // the devices have given a picture
  bool sized_ = false;                       // the sizes of the cameras' pictures are known
  Eigen::Vector2d sign_centre_px_;
};

}  // namespace slsd
