// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/verdict.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/calibrate/judge/coverage.hpp"

namespace slsd {
namespace {

constexpr double kDistanceSpread = 1.15;  // ratio of the farthest to the nearest pose
constexpr double kFarFromRange = 1.5;

class Jury {
 public:
  Verdict verdict{.grade = Grade::kGood, .reasons = {}, .advice = {}};

  void judge(double value, const Bounds& bounds, const std::string& reason) {
    if (value <= bounds.good) return;
    lower(value <= bounds.usable ? Grade::kUsable : Grade::kBad);
    verdict.reasons.push_back(reason);
  }
  void lower(Grade grade) { verdict.grade = std::max(verdict.grade, grade); }
};

void judge_coverage(const CalibrationOutcome& outcome, Jury& jury) {
  const auto ask = [&](const Coverage& coverage, const std::string& device) {
    if (coverage.share() >= kCoverageGood) return;
    jury.lower(Grade::kUsable);
    jury.verdict.reasons.push_back(fmt::format("the poses cover {:.0f} % of {}'s image; good is {:.0f} %",
                                               100 * coverage.share(), device, 100 * kCoverageGood));
    jury.verdict.advice.push_back(fmt::format("show the board in {} of {}'s image", coverage.emptiest(), device));
  };
  for (std::size_t i = 0; i < outcome.observations.cameras.size(); ++i) {
    ask(camera_coverage(outcome.observations, i), "camera " + outcome.observations.cameras[i].name);
  }
  ask(projector_coverage(outcome.observations), "the projector");
}

void judge_poses(const CalibrationOutcome& outcome, Jury& jury) {
  const auto tilts = tilts_deg(outcome.rig), distances = distances_mm(outcome.rig);
  if (tilts.size() < kPosesGood) {
    jury.lower(Grade::kUsable);
    jury.verdict.reasons.push_back(fmt::format("only {} poses were used; {} are good", tilts.size(), kPosesGood));
    jury.verdict.advice.push_back("take more poses");
  }
  if (std::ranges::max(tilts) < kTiltGoodDeg) {
    jury.lower(Grade::kUsable);
    jury.verdict.reasons.push_back(
        fmt::format("no pose is tilted by more than {:.0f} degrees, which leaves the focal lengths uncertain",
                    std::ranges::max(tilts)));
    jury.verdict.advice.push_back("tilt the board by 20 to 40 degrees, each time to another side");
  }
  if (std::ranges::max(distances) < kDistanceSpread * std::ranges::min(distances)) {
    jury.verdict.advice.push_back("vary the board's distance over the working range");
  }
}

// The lengths of boards outside the working range are likely of another unit.
void judge_distances(const CalibrationOutcome& outcome, double depth_min_mm, double depth_max_mm, Jury& jury) {
  if (outcome.depth.empty()) return;  // already bad, with its own remedy
  const auto [nearest, farthest] = std::ranges::minmax(distances_mm(outcome.rig));
  if (farthest >= depth_min_mm && nearest <= depth_max_mm) return;
  const bool far = farthest * kFarFromRange < depth_min_mm || nearest > depth_max_mm * kFarFromRange;
  jury.lower(far ? Grade::kBad : Grade::kUsable);
  jury.verdict.reasons.push_back(
      fmt::format("the boards were {:.3g} to {:.3g} mm away, but the working range is {:g} to {:g} mm", nearest,
                  farthest, depth_min_mm, depth_max_mm));
  jury.verdict.advice.emplace_back(
      "give the lengths of --board in millimetres, or set depth_min_mm and depth_max_mm in [decode] to your scanning "
      "distances");
}

}  // namespace

Verdict judge(const CalibrationOutcome& outcome, double depth_min_mm, double depth_max_mm) {
  Jury jury;
  jury.judge(outcome.held_out_corner_px, kHeldOutPx,
             fmt::format("corners of held-out poses are off by {:.2f} px; good is {:.1f} px",
                         outcome.held_out_corner_px, kHeldOutPx.good));
  jury.judge(outcome.held_out_symbol_px, kHeldOutPx,
             fmt::format("symbols of held-out poses are off by {:.2f} px; good is {:.1f} px",
                         outcome.held_out_symbol_px, kHeldOutPx.good));
  jury.judge(outcome.epipolar_rms_px, kEpipolarPx,
             fmt::format("symbols lie {:.2f} px off their epipolar lines; good is {:.1f} px", outcome.epipolar_rms_px,
                         kEpipolarPx.good));
  if (outcome.depth.empty()) {
    jury.lower(Grade::kBad);
    jury.verdict.reasons.emplace_back("the first camera and the projector share no view in the working range");
    jury.verdict.advice.emplace_back(
        "set depth_min_mm and depth_max_mm in [decode] to your scanning distances, or turn camera and projector "
        "towards each other and calibrate again");
  } else {
    const DepthUncertainty& middle = outcome.depth[outcome.depth.size() / 2];
    jury.judge(middle.calibration_mm / middle.depth_mm, kDepthShare,
               fmt::format("the calibration leaves depth at {:.0f} mm uncertain by {:.2f} mm; good is {:.2f} mm",
                           middle.depth_mm, middle.calibration_mm, kDepthShare.good * middle.depth_mm));
  }
  judge_coverage(outcome, jury);
  judge_poses(outcome, jury);
  judge_distances(outcome, depth_min_mm, depth_max_mm, jury);
  if (!outcome.warnings.empty()) jury.lower(Grade::kUsable);
  return jury.verdict;
}

}  // namespace slsd
