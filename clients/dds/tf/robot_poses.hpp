// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "network/network.hpp"
#include "tf/transform_tree.hpp"

namespace slsd::dds {

/// The frames of a robot in tf.
struct RobotFrames {
  std::string base = "base_link";
  std::string flange;
};

/// The poses of a robot's flange, from /tf and /tf_static. Has one thread, which reads them.
/// @thread thread-safe
class RobotPoses {
 public:
  static constexpr std::chrono::milliseconds kWait{500};  ///< longest wait for a transform of the time of exposure

  /// @param network  must outlive it  @errors kInvalidArgument: frames without two names; those of Network::reader()
  [[nodiscard]] static Result<std::unique_ptr<RobotPoses>> open(const Network& network, const RobotFrames& frames);

  /// base_from_flange at that time, in millimetres. Waits until tf has a transform at that time or later, at most
  /// kWait.
  /// @errors of TransformTree::base_from_flange(); kMismatch: tf_unreachable
  [[nodiscard]] Result<RigidTransform> at(RosTime time) const;

  /// The present base_from_flange of a flange that stands still: in the half second before, it moved by no more than
  /// 0.3 mm and 0.03 degrees. Waits for half a second of transforms, at most ten seconds.
  /// @errors as at(); kBusy: flange_moves
  [[nodiscard]] Result<RigidTransform> standing() const;

 private:
  RobotPoses(const Network& network, RobotFrames frames, Reader moving, Reader fixed);
  void read();
  void take(const Reader& reader, bool fixed);
  // Adds to an error what was refused lately, as that may be its reason.
  [[nodiscard]] Result<RigidTransform> with_refused(Result<RigidTransform> pose) const;
  [[nodiscard]] Result<RigidTransform> look_up(RosTime time) const;
  [[nodiscard]] Result<RigidTransform> look_up_standing() const;

  const Network& network_;
  RobotFrames frames_;
  Reader moving_, fixed_;
  mutable std::mutex mutex_;  ///< guards the members below, before the thread
  mutable std::condition_variable changed_;
  TransformTree tree_;
  std::string refused_;
  RosTime refused_at_{};
  std::jthread reader_;
};

}  // namespace slsd::dds
