// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "core/geometry/calibration.hpp"
#include "core/result.hpp"
#include "ros.hpp"

namespace slsd::dds {

/// Time stamps of ROS: UTC, since 1970.
using RosTime = std::chrono::sys_time<std::chrono::nanoseconds>;
[[nodiscard]] RosTime time_of(const ros::Time& stamp);

/// The frames of a robot, and their poses in the last seconds, as tf publishes them. It rather gives no pose than a
/// doubtful one: nothing is extrapolated, and contradicting publishers are refused.
///
///     world ── base_link ── shoulder ── ... ── wrist ── flange ── tool0
///     each child names its parent, and has a pose in it at each of several times
///
/// Messages begin with a name: tf_malformed, tf_stamp, tf_future, tf_old, tf_full, tf_two_parents (of add());
/// tf_missing, tf_unconnected, tf_loop, tf_two_parents, tf_late, tf_history, tf_gap (of the others).
/// @thread thread-bound
class TransformTree {
 public:
  static constexpr std::chrono::seconds kHistory{10};
  static constexpr std::chrono::milliseconds kGapMax{250};   ///< longest time between two poses to interpolate
  static constexpr std::chrono::milliseconds kAheadMax{50};  ///< how far stamps may be in the future
  static constexpr std::size_t kFramesMax = 10'000, kSamplesMax = 200'000;

  /// Adds a transform. A refused one changes nothing, except that another parent or publisher of a frame makes lookups
  /// of it fail: as long as it publishes and ten seconds more; for fixed transforms always.
  /// @param fixed      of /tf_static: holds at all times, its stamp does not count
  /// @param publisher  identifies the writer
  /// @errors kMalformed: numbers or names; kInvalidArgument: the stamp; kMismatch: a second parent or publisher;
  ///         kNoSpace
  [[nodiscard]] Result<> add(const ros::TransformStamped& transform, bool fixed, std::uint64_t publisher, RosTime now);

  /// The pose of a frame in another one, in millimetres: linear in the place and spherical in the turn of each link
  /// between its two poses next to that time.
  /// @errors kNotFound: tf lacks a frame or their connection; kTimeout: the newest transform is older; kImpossible: the
  ///         kept ones are newer; kMismatch: two are too far apart, a loop, or two parents
  [[nodiscard]] Result<RigidTransform> base_from_flange(const std::string& base, const std::string& flange, RosTime at,
                                                        RosTime now) const;

  /// The newest time for which a pose is known; `now` if all links are fixed. @errors as base_from_flange()
  [[nodiscard]] Result<RosTime> newest(const std::string& base, const std::string& flange, RosTime now) const;

 private:
  struct Pose {
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  };
  struct Sample {
    RosTime at;
    Pose pose;
  };
  /// Places a frame in its parent.
  struct Link {
    std::string parent;
    bool fixed = false;
    std::uint64_t publisher = 0;
    std::deque<Sample> samples;  ///< by time; one if fixed
    std::string rival;           ///< who else places the frame; empty: nobody
    RosTime rival_until{};
  };
  using Path = std::vector<const std::pair<const std::string, Link>*>;  ///< from a frame to its ancestor
  struct Paths {
    Path base, flange;  ///< to their common ancestor
  };

  [[nodiscard]] Result<> add_sample(Link& link, const std::string& child, const Sample& sample);
  [[nodiscard]] Result<Path> path_to_root(const std::string& frame) const;
  [[nodiscard]] Result<Paths> paths(const std::string& base, const std::string& flange, RosTime now) const;
  [[nodiscard]] static Result<Pose> pose_at(const std::string& child, const Link& link, RosTime at);

  std::map<std::string, Link> links_;  ///< by child
  std::size_t samples_ = 0;
};

}  // namespace slsd::dds
