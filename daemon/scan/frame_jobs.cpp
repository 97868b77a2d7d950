// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/scan/frame_jobs.hpp"

#include <utility>

#include "daemon/scan/frame_image.hpp"
#include "daemon/scan/reconstruct.hpp"

namespace slsd {
namespace {

tl::unexpected<Error> fail_stopping() {
  return fail(ErrorCode::kCancelled, "the service is stopping");
}

}  // namespace

ScanJob::ScanJob(Result<FrameSet> set, SharedSetup setup, ScanRequest request, std::string scan_id, Told told)
    : set_(std::move(set)),
      setup_(std::move(setup)),
      request_(std::move(request)),
      scan_id_(std::move(scan_id)),
      told_(std::move(told)),
      result_(fail_stopping()) {}

void ScanJob::compute(std::size_t lane) {
  result_ = set_ ? reconstruct(*set_, *setup_, lane, request_, scan_id_) : tl::unexpected(set_.error());
  if (set_) set_->give_back();  // back to the driver before others have had their turn
}

ImageJob::ImageJob(Frame frame, bool as_png, Told told)
    : frame_(std::move(frame)), as_png_(as_png), told_(std::move(told)), result_(fail_stopping()) {}

void ImageJob::compute(std::size_t) {
  result_ = as_png_ ? png_of(*frame_) : raw_of(*frame_);
  frame_.reset();
}

}  // namespace slsd
