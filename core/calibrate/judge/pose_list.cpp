// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/pose_list.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/calibrate/judge/view_demands.hpp"

namespace slsd {
namespace {

constexpr double kClippedToSay = 0.02;  // more than a session on hardware accepts

std::string text_of_gap(const PoseView& view) {
  if (view.hidden_clipped) {
    return fmt::format(
        "clipped: the white picture is at full level where {} symbols should be; turn the reflection away, or expose "
        "less",
        view.hidden_symbols);
  }
  return fmt::format(
      "covered: {} symbols are missing in one place, although the white picture shows the board there; keep hands and "
      "cables out of the light in all pictures",
      view.hidden_symbols);
}

}  // namespace

PoseList::PoseList(const Observations& observations) {
  for (const PoseObservation& pose : observations.poses) {
    PoseReport& report = reports_.emplace_back();
    report.name = pose.name, report.subject = pose.subject;
    used_.push_back(used_.size());
    for (const PoseView& view : pose.views) {
      report.corners += view.corners.size(), report.symbols += view.symbols.size();
      if (view.hidden_symbols > 0) report.remarks.push_back(text_of_gap(view));
      if (view.clipped_share <= kClippedToSay) continue;
      report.remarks.push_back(
          fmt::format("{:.0f} % of the board's pixels are at full level: expose less", 100 * view.clipped_share));
    }
  }
}

void PoseList::leave_out(const FaultyPose& faulty, Observations& observations, RigModel* rig) {
  const auto at = static_cast<std::ptrdiff_t>(faulty.pose);
  PoseReport& report = used(faulty.pose);
  report.fault = faulty.fault, report.reason = faulty.reason;
  used_.erase(used_.begin() + at);
  observations.poses.erase(observations.poses.begin() + at);
  if (rig != nullptr) rig->rig_from_board.erase(rig->rig_from_board.begin() + at);
}

void PoseList::leave_views_out(Observations& observations) {
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    PoseReport& report = used(i);
    std::erase_if(observations.poses[i].views, [&](const PoseView& view) {
      const std::string lack = lack_of_corners(view);
      if (lack.empty()) return false;
      report.without.push_back("camera " + observations.cameras[view.camera].name + ": " + lack);
      report.corners -= view.corners.size(), report.symbols -= view.symbols.size();
      return true;
    });
  }
}

void PoseList::explain(const std::string& pose, const std::string& more) {
  const auto report = std::ranges::find(reports_, pose, &PoseReport::name);
  if (report != reports_.end() && report->fault) report->reason += more;
}

bool PoseList::lacks(PoseSubject subject) const {
  const auto same = [&](const PoseReport& report) { return report.subject == subject; };
  return std::ranges::any_of(reports_, same) &&
         std::ranges::none_of(used_, [&](std::size_t i) { return same(reports_[i]); });
}

std::string PoseList::faults() const {
  std::string text;
  for (const PoseReport& report : reports_) {
    if (report.fault) text += (text.empty() ? "" : "; ") + report.name + ": " + report.reason;
  }
  return text;
}

}  // namespace slsd
