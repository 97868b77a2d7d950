// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/scan.hpp"

#include <utility>

#include "daemon/scan/cloud/merge_frames.hpp"
#include "daemon/scan/cloud/reconstruct.hpp"
#include "drivers/camera/frame_image.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLostKept = 8;

tl::unexpected<Error> fail_stopping() {
  return fail(ErrorCode::kCancelled, "the service is stopping");
}

// The outcome of all tries. A try that the deadline cut short says less than the tries before it.
Error after_tries(Error error, const LostTries& lost) {
  if (lost.count == 0) return error;
  const bool cut_short = error.code == ErrorCode::kFrameLate || error.code == ErrorCode::kTimeout;
  if (cut_short) error = lost.last.back();
  error.message += " (" + std::to_string(lost.count + 1) +
                   " tries; the error before: " + std::string(to_string(lost.last.back().code)) + ")";
  return error;
}

}  // namespace

bool may_be_taken_again(const Error& error) {
  switch (error.code) {
    case ErrorCode::kFrameDropped:
    case ErrorCode::kFrameTorn:
    case ErrorCode::kFrameStale:
    case ErrorCode::kFrameLate:
      return true;
    default:
      return false;
  }
}

Scan::Scan(ScanRequest request, std::uint64_t number, std::string id, Told told, Keep keep)
    : TaskOf(request.deadline,
             [this, told = std::move(told)](Result<ScanResult> result) { told(*this, std::move(result)); }),
      request_(std::move(request)),
      number_(number),
      id_(std::move(id)),
      keep_(std::move(keep)),
      set_(fail_stopping()),
      result_(fail_stopping()) {}

void Scan::note_lost(const Error& error) {
  ++lost_.count;
  if (lost_.last.size() == kLostKept) lost_.last.erase(lost_.last.begin());
  lost_.last.push_back(error);
}

void Scan::expose(Rig& rig, HardwareGuard& hardware, SharedSetup setup, const WaitLimit& limit, Exposure exposure,
                  CloudFormats formats) {
  setup_ = std::move(setup);
  request_.formats = request_.formats | formats;
  if (auto possible = setup_->check(request_); !possible) {
    set_ = tl::unexpected(possible.error());
    return;
  }
  set_ = rig.capture(limit, exposure, {request_.texture, request_.ambient, request_.colour});
  if (!set_) set_ = tl::unexpected(after_tries(set_.error(), lost_));
  if (!set_) return;
  if (auto same = hardware.check(setup_, rig); !same) set_ = tl::unexpected(same.error());
}

void Scan::compute(std::size_t lane) {
  const bool in_time = !over();
  if (set_ && in_time) {
    auto merged = merge_frames(*set_, *setup_);
    result_ = reconstruct(*set_, *setup_, lane, request_, id_);
    if (result_) result_->merged = std::move(merged);
  }
  if (!set_) result_ = tl::unexpected(set_.error());
  if (set_ && keep_) keep_(*this, *set_);
  if (set_) set_->give_back();  // back to the driver before other jobs have their turn
  if (!result_ || !in_time) return;
  result_->lost = std::move(lost_);
  result_->files = CloudFiles(result_->cloud, result_->dense.get(), request_.formats,
                              setup_->base_from_rig(request_.base_from_flange));
  const bool on_arm = setup_->hand_eye && setup_->hand_eye->mounted == Mounted::kArm;
  if (on_arm && setup_->check_robot_base()) result_->flange_from_rig = setup_->hand_eye->mount_from_rig;
}

void Scan::fail_compute(std::size_t lane, Error error) {
  result_ = tl::unexpected(std::move(error));
  if (set_) set_->give_back();
  if (setup_) setup_->dense->drop(lane);
}

FrameTask::FrameTask(FrameRequest request, Answer answer)
    : TaskOf(request.deadline, std::move(answer)),
      request_(std::move(request)),
      frame_(fail_stopping()),
      result_(fail_stopping()) {}

void FrameTask::expose(Rig& rig, const ScanSetup& setup, const WaitLimit& limit) {
  if (auto known = setup.check_camera(request_.camera); !known) {
    frame_ = tl::unexpected(known.error());
  } else {
    frame_ = rig.capture_one(setup.camera_index(request_.camera), limit, request_.as_shown);
  }
}

void FrameTask::compute(std::size_t) {
  if (!frame_) {
    result_ = tl::unexpected(frame_.error());
    return;
  }
  result_ = request_.as_png ? png_of(*frame_) : raw_of(*frame_);
  frame_ = fail_stopping();
}

void FrameTask::fail_compute(std::size_t, Error error) {
  result_ = tl::unexpected(std::move(error));
  frame_ = fail_stopping();
}

}  // namespace slsd
