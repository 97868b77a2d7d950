// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/result.hpp"
#include "daemon/scan/cloud/decode_lanes.hpp"
#include "daemon/scan/cloud/scan_result.hpp"
#include "daemon/scan/rig/frame_set.hpp"
#include "daemon/scan/rig/hardware_guard.hpp"
#include "daemon/scan/rig/rig.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "daemon/scan/task.hpp"

namespace slsd {

/// One scan, from its request to its outcome. Waits for its turn, takes the frames (again if some are lost and time is
/// left), decodes them, writes the cloud, and answers in order.
///
///     waiting --> expose() --> compute() --> deliver() --> over
///                 scanner      a lane        in order
///
/// @thread thread-safe as a Task; each step belongs to one thread
class Scan final : public TaskOf<ScanResult>, public FrameJob {
 public:
  using Told = std::function<void(const Scan&, Result<ScanResult>)>;
  using Keep = std::function<void(const Scan&, const FrameSet&)>;
  /// @param number  number of the scan since the start
  /// @param id      its name for clients
  /// @param told    called once, with the outcome
  /// @param keep    called with the frames before they return to the drivers; may be empty
  Scan(ScanRequest request, std::uint64_t number, std::string id, Told told, Keep keep = {});

  [[nodiscard]] const ScanRequest& request() const { return request_; }
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] const std::string& id() const { return id_; }
  /// The setup that decodes the scan; null before its turn.
  [[nodiscard]] const SharedSetup& setup() const { return setup_; }
  [[nodiscard]] bool exposed() const { return set_.has_value(); }

  /// Takes the frames, or finds out why it cannot.
  /// @param limit  this task's own
  /// @param formats   the forms that subscribers want in addition to the request's
  void expose(Rig& rig, HardwareGuard& hardware, SharedSetup setup, const WaitLimit& limit, Exposure exposure,
              CloudFormats formats);
  /// Notes a try that lost its frames and is repeated; the outcome reports it.
  void note_lost(const Error& error);

  void compute(std::size_t lane) override;
  void fail_compute(std::size_t lane, Error error) override;
  void deliver() override { end(std::move(result_)); }

 private:
  ScanRequest request_;
  std::uint64_t number_;
  std::string id_;
  Keep keep_;
  SharedSetup setup_;
  LostTries lost_;
  Result<FrameSet> set_;
  Result<ScanResult> result_;
};

/// One frame of one camera, from the request to its image.
class FrameTask final : public TaskOf<FrameImage>, public FrameJob {
 public:
  FrameTask(FrameRequest request, Answer answer);

  [[nodiscard]] const FrameRequest& request() const { return request_; }
  void expose(Rig& rig, const ScanSetup& setup, const WaitLimit& limit);

  void compute(std::size_t lane) override;
  void fail_compute(std::size_t lane, Error error) override;
  void deliver() override { end(std::move(result_)); }

 private:
  FrameRequest request_;
  Result<Frame> frame_;
  Result<FrameImage> result_;
};

/// Tells whether another try may give a whole frame: this one was lost, torn or late.
[[nodiscard]] bool may_be_taken_again(const Error& error);

}  // namespace slsd
