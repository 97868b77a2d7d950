// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <glog/logging.h>

#include "programs/carry_out.hpp"
#include "programs/hand_eye/hand_eye_from_files.hpp"

namespace {

slsd::Result<> hand_eye(const slsd::HandEyeRequest& request) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // the result is judged anyway, so Ceres need not warn
  const bool by_socket = request.from_service || !request.pose.empty();
  return by_socket ? slsd::hand_eye_by_socket(request) : slsd::hand_eye_from_files(request);
}

}  // namespace

int main(int argc, char** argv) {
  return slsd::carry_out(argc, argv, "hand-eye", slsd::kHandEyePurpose, &slsd::add_hand_eye_options, &hand_eye);
}
