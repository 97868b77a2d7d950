// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/verifier.hpp"

#include <iostream>

#include <fmt/format.h>

#include "core/calibrate/observe/observe_plane.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "programs/calibrate/board_request.hpp"
#include "programs/verify/verify_text.hpp"

namespace slsd {
namespace {

/// The requested board; else the calibration's, if its file names one that we can parse.
Result<Board> board_to_look_for(const CalibrateRequest& request, const Calibration& calibration) {
  if (request.board.empty() && !request.ruler.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "needs --board, which names the print: the board in the calibration file already has its measured size",
                "--ruler " + request.ruler);
  }
  if (request.board.empty() && calibration.report.board) {
    if (auto board = parse_board(*calibration.report.board)) return board;
  }
  return requested_board(request);
}

ImageSize size_of(const Lens& lens) {
  return {lens.width_px, lens.height_px};
}

Result<> check_size(const CapturedPictures& pictures, const CalibratedCamera& camera, const std::string& name) {
  const ImageSize own = size_of(camera.lens);
  for (const GreyImage& picture : pictures.coded) {
    const ImageSize seen = size_of(picture);
    if (seen == own) continue;
    return fail(
        ErrorCode::kMismatch,
        fmt::format(
            "has pictures of {}x{} px, but its calibration is for {}x{}: set the camera's size, or calibrate again",
            seen.width_px, seen.height_px, own.width_px, own.height_px),
        name);
  }
  return {};
}

/// Three depths: those of the calibration's own deviations, or over the configured range.
std::vector<double> depths_to_predict(const Calibration& calibration, const Configuration& configuration) {
  std::vector<double> depths_mm;
  for (const CalibrationReport::DepthSigma& known : calibration.report.depth_sigma) depths_mm.push_back(known.depth_mm);
  if (!depths_mm.empty()) return depths_mm;
  const double near_mm = configuration.decode.depth_min_mm, far_mm = configuration.decode.depth_max_mm;
  return {near_mm, 0.5 * (near_mm + far_mm), far_mm};
}

}  // namespace

Result<Verifier> Verifier::create(const CalibrateRequest& request, const Configuration& configuration, Pattern pattern,
                                  bool gray_code) {
  auto calibration = configured_calibration(configuration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (!*calibration) {
    return fail(ErrorCode::kNotFound, "no calibration to verify: calibrate, or set [calibration] file");
  }
  const ImageSize projector = size_of((*calibration)->projector);
  const PatternOptions& shown = pattern.options;
  if (!gray_code && projector != ImageSize{shown.projector_width_px, shown.projector_height_px}) {
    return fail(
        ErrorCode::kMismatch,
        fmt::format("the pattern is for a projector of {}x{} px, but the calibration for {}x{}: use a matching pair",
                    shown.projector_width_px, shown.projector_height_px, projector.width_px, projector.height_px));
  }
  const auto board = board_to_look_for(request, **calibration);
  if (!board) return tl::unexpected(board.error());
  Verifier verifier(std::move(**calibration), *board, std::move(pattern));
  verifier.gray_code_ = gray_code;
  verifier.board_asked_for_ = !request.board.empty();
  verifier.needs_board_ = request.correct;
  verifier.correct_options_ = {!request.ruler.empty(), depths_to_predict(verifier.calibration_, configuration)};
  verifier.observations_.projector = projector;
  for (const CalibratedCamera& camera : verifier.calibration_.cameras) {
    verifier.observations_.cameras.push_back({camera.name, size_of(camera.lens)});
  }
  verifier.limits_.epipolar_px = epipolar_limit_px(verifier.calibration_.report.epipolar_error_px);
  if (!configuration.cameras.empty()) verifier.first_camera_ = configuration.cameras.front().name();
  const auto& date = verifier.calibration_.report.date;
  const auto& corrected = verifier.calibration_.report.corrected;
  std::cout << fmt::format("calibration {}{}{}, board {}\n", configuration.calibration_file.string(),
                           date ? " of " + *date : "", corrected ? ", corrected " + *corrected : "", to_string(*board));
  return verifier;
}

Result<PoseView> Verifier::observe_without_board(const PosePictures& pictures, bool has_white,
                                                 PatternReader& reader) const {
  if (!gray_code_) {
    return observe_plane(pictures.coded.at(0), has_white ? std::optional(pictures.white) : std::nullopt, reader);
  }
  if (!pictures.black) return fail(ErrorCode::kNotFound, "a Gray code also needs a picture under the black projector");
  return observe_plane({pictures.white, *pictures.black, pictures.coded}, size_of(calibration_.projector));
}

Result<PoseView> Verifier::observe(const CapturedPictures& owned, std::size_t camera, std::string& remark) {
  const PosePictures pictures = owned.views();
  PatternReader& reader = readers_.try_emplace(camera, pattern_).first->second;
  const bool has_white = size_of(owned.white) != ImageSize{};
  if (!has_white) return observe_without_board(pictures, has_white, reader);
  BoardSighting sighting;
  auto view = observe_board(pictures, board_, sighting);
  if (!view) {
    remark = to_string(view.error());
    return observe_without_board(pictures, has_white, reader);
  }
  const auto read = gray_code_ ? observe_gray_code(pictures, board_, sighting, size_of(calibration_.projector), *view)
                               : observe_pattern(pictures, board_, sighting, reader, *view);
  if (!read) return tl::unexpected(read.error());
  return view;
}

Result<> Verifier::look(const std::string& pose, const std::string& camera, const CapturedPictures& pictures) {
  const std::string name = pose + (pose.empty() || camera.empty() ? "" : " ") + camera;
  const CalibratedCamera* const known = calibration_.camera(camera.empty() ? first_camera_ : camera);
  if (known == nullptr) return fail(ErrorCode::kNotFound, "the calibration has no camera of this name", camera);
  if (auto fits = check_size(pictures, *known, name); !fits) return fits;
  if (needs_board_ && size_of(pictures.white) == ImageSize{}) {
    return fail(ErrorCode::kNotFound, "has no white.png, and a correction finds the board only in that picture", name);
  }
  std::string remark;
  const auto index = static_cast<std::size_t>(known - calibration_.cameras.data());
  const auto view = observe(pictures, index, remark);
  if (needs_board_ && !remark.empty()) return fail(ErrorCode::kNotFound, remark, name);
  if (needs_board_ && !view) return fail(view.error().code, to_string(view.error()), name);
  if (view && !view->corners.empty()) {
    if (observations_.poses.empty() || observations_.poses.back().name != pose)
      observations_.poses.emplace_back().name = pose;
    observations_.poses.back().views.push_back(*view), observations_.poses.back().views.back().camera = index;
  }
  if (!remark.empty()) std::cout << fmt::format("{}: measured as a plain plane: {}\n", name, remark);
  const auto check = view ? check_view(*view, *known, calibration_.projector) : tl::unexpected(view.error());
  if (!check) {
    std::cout << fmt::format("{}: cannot be measured: {}", name, to_string(check.error())) << std::endl;
    return {};
  }
  std::cout << fmt::format("{}: {}", name, check_text(*check, limits_)) << std::endl;
  checks_.push_back(*check);
  return {};
}

Result<Correction> Verifier::find_correction() const {
  if (observations_.poses.empty()) return fail(ErrorCode::kNotFound, "a correction needs a view of the board");
  return correct_calibration(observations_, board_, calibration_, correct_options_);
}

void Verifier::check_again(const Calibration& calibration) const {
  for (const PoseObservation& pose : observations_.poses) {
    for (const PoseView& view : pose.views) {
      const auto check = check_view(view, calibration.cameras[view.camera], calibration.projector);
      if (check) std::cout << fmt::format("after: {}\n", check_text(*check, limits_));
    }
  }
}

/// Names the correction that would repair a calibration which no longer fits; empty: none.
std::string Verifier::offer() const {
  const auto correction = find_correction();
  if (!correction || !correction->needed) return {};
  return fmt::format(". Or repair it from this view with slsd --correct: {}", correction->drift);
}

Result<> Verifier::finish() const {
  if (checks_.empty()) {
    return fail(ErrorCode::kNotFound,
                "nothing could be measured, so the calibration was not checked; if the board is lit and in focus, the "
                "rig is far from its calibration: calibrate again");
  }
  const VerifySummary summary = summarise(checks_, limits_);
  std::cout << summary_text(summary, limits_) << std::flush;
  if (!summary.faults.empty()) {
    return fail(ErrorCode::kMismatch, "the calibration no longer fits: " + advice(summary) + offer());
  }
  if (board_asked_for_ && summary.views_with_board == 0) {
    return fail(ErrorCode::kNotFound, "the board was never in view, so distances were not checked: show it",
                describe(board_));
  }
  return {};
}

}  // namespace slsd
