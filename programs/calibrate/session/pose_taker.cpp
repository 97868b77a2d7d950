// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/pose_taker.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/calibrate/judge/view_demands.hpp"

namespace slsd {
namespace {

constexpr double kMovedPx = 0.5;
constexpr double kClippedShare = 0.02;
constexpr double kBlurMaxPx = 2.5;
constexpr double kFlatDeg = 60;

Result<> judge_light(const BoardSighting& sighting, double usual_blur_px) {
  if (sighting.clipped_share > kClippedShare) {
    return fail(ErrorCode::kImpossible, fmt::format("clipped: {:.0f} % of the board's pixels are at full level or at "
                                                    "0; change the exposure, or turn a reflection away",
                                                    100 * sighting.clipped_share));
  }
  const double blur = sighting.edge_px;
  const bool unlike = is_blurred(blur, usual_blur_px);
  if (blur > kBlurMaxPx || unlike) {
    return fail(
        ErrorCode::kImpossible,
        fmt::format("blurred: edges are {:.1f} px wide{}; hold the board still, and where the camera is in focus", blur,
                    unlike ? fmt::format(", {:.1f} px in the other poses", usual_blur_px) : ""));
  }
  return {};
}

std::string moved_text(const BoardSightings& before, const BoardSightings& after) {
  if (!is_seen(after)) return "moved: the board was out of view after the pattern; hold it until the tick";
  const double moved = moved_px(before, after);
  if (moved <= kMovedPx) return {};
  return fmt::format("moved by {:.1f} px during the pose; hold the board until the tick, or lean it against something",
                     moved);
}

std::string join(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text;
}

}  // namespace

std::string PoseTrial::why() const {
  return join(lacks);
}

PoseTaker::PoseTaker(PoseSource& source, PoseObserver& observer, std::vector<Grey8> images, bool gray_code)
    : source_(source),
      observer_(observer),
      images_(std::move(images)),
      gray_code_(gray_code),
      white_(source.projector().width_px, source.projector().height_px, 255),
      black_(source.projector().width_px, source.projector().height_px, 0) {}

Result<std::vector<GreyImage>> PoseTaker::grab_under(const Grey8& image) {
  source_.show(image);
  return source_.grab();
}

Result<BoardView> PoseTaker::look() {
  auto pictures = grab_under(white_);
  if (!pictures) return tl::unexpected(pictures.error());
  return look_for_board(std::move(*pictures), observer_.board());
}

Result<> PoseTaker::project(std::vector<CapturedPictures>& pictures) {
  for (const Grey8& image : images_) {
    auto seen = grab_under(image);
    if (!seen) return tl::unexpected(seen.error());
    for (std::size_t i = 0; i < pictures.size(); ++i) pictures[i].coded.push_back(std::move(seen->at(i)));
  }
  if (!gray_code_) return {};
  auto dark = grab_under(black_);
  if (!dark) return tl::unexpected(dark.error());
  for (std::size_t i = 0; i < pictures.size(); ++i) pictures[i].black = std::move(dark->at(i));
  return {};
}

Result<PoseView> PoseTaker::judge(std::size_t camera, const Result<BoardSighting>& sighting,
                                  const CapturedPictures& pictures, double usual_blur_px) {
  if (!sighting) return tl::unexpected(sighting.error());
  if (auto fit = judge_light(*sighting, usual_blur_px); !fit) return tl::unexpected(fit.error());
  auto view = observer_.observe(camera, pictures.views());
  if (!view) return view;
  for (std::string lack : {lack_of_corners(*view), lack_of_symbols(view->symbols.size())}) {
    if (!lack.empty()) return fail(ErrorCode::kNotFound, std::move(lack));
  }
  return view;
}

Result<PoseTrial> PoseTaker::take(BoardView before, const PoseCollection& taken) {
  PoseTrial trial;
  for (GreyImage& white : before.pictures) trial.pictures.push_back({std::move(white), {}, std::nullopt});
  if (auto projected = project(trial.pictures); !projected) return tl::unexpected(projected.error());
  const auto after = look();
  if (!after) return tl::unexpected(after.error());
  if (auto moved = moved_text(before.sightings, after->sightings); !moved.empty()) {
    trial.lacks.push_back(std::move(moved));
    return trial;
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto& cameras = source_.cameras();
  for (std::size_t i = 0; i < trial.pictures.size(); ++i) {
    const std::string who = cameras.size() > 1 ? "camera " + cameras[i] + ": " : "";
    auto view = judge(i, before.sightings[i], trial.pictures[i], taken.usual_blur_px(i));
    if (!view) {
      trial.lacks.push_back(who + to_string(view.error()));
      continue;
    }
    const auto place = place_of(ties_of(*view), observer_.board(), taken.observations().cameras[i].size);
    if (place && place->tilt_deg() > kFlatDeg) {
      trial.advice.push_back(
          fmt::format("{}the board is tilted too far, by about {:.0f} degrees", who, place->tilt_deg()));
    }
    trial.views.push_back(std::move(*view));
  }
  trial.work = std::chrono::steady_clock::now() - begin;
  return trial;
}

}  // namespace slsd
