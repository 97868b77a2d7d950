// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/verify_text.hpp"

#include <fmt/format.h>

namespace slsd {
namespace {

std::string_view verdict(bool faulty) {
  return faulty ? "FAIL" : "PASS";
}

std::string trueness_text(const std::optional<Trueness>& trueness, const VerifyLimits& limits) {
  if (!trueness) return "no board, no distances";
  return fmt::format("{} corners, scale {:+.3f} %, long distances {:.3f} % (at most {:.1f}), the worst {:+.3f} %",
                     trueness->corners, trueness->scale_percent, trueness->long_rms_percent, limits.trueness_percent,
                     trueness->worst_percent);
}

/// The turn that this view cannot detect.
std::string blind_text(const ViewCheck& check) {
  if (!check.blind_axis) return "";
  Eigen::Index most = 0;
  check.blind_axis->cwiseAbs().maxCoeff(&most);
  const std::string axis = fmt::format("; a turn about the projector's {} axis does not show here", "xyz"[most]);
  return check.trueness ? axis + ", but does in the distances" : axis + ": show it a board";
}

std::string advice_for(VerifyFault fault, double scale_percent) {
  switch (fault) {
    case VerifyFault::kEpipolar:
      return "the symbols lie off their epipolar lines: the projector or camera moved, turned or was refocused; fasten "
             "both, and calibrate again";
    case VerifyFault::kPlane:
      return "a flat surface measures as bent: try one that is certainly flat, such as glass; if it measures as bent "
             "too, calibrate again, with poses all over both images";
    case VerifyFault::kScale:
      return fmt::format(
          "all distances are {:.2f} % too {}: measure the board's ruler, and give --board and --ruler; if the board is "
          "right, calibrate again with both",
          std::abs(scale_percent), scale_percent > 0 ? "long" : "short");
    case VerifyFault::kDistances:
      break;
  }
  return "distances are wrong by different shares: keep the board still and flat, and verify again; if they stay "
         "wrong, calibrate again";
}

}  // namespace

std::string check_text(const ViewCheck& check, const VerifyLimits& limits) {
  return fmt::format(
      "{} symbols at {:.0f} mm ({} left out); {:.3f} px off their epipolar lines (at most {:.2f}), like a turn of "
      "{:.3f} degrees (at most {:.2f}{}); {:.3f} mm off the plane (at most {:.3f}); {}: {}",
      check.symbols, check.distance_mm, check.left_out, check.epipolar_rms_px, limits.epipolar_px, check.turn_deg,
      limits.turn_deg, blind_text(check), check.plane_rms_mm, check.plane_limit_mm(limits),
      trueness_text(check.trueness, limits), verdict(!find_faults(check, limits).empty()));
}

std::string summary_text(const VerifySummary& summary, const VerifyLimits& limits) {
  std::string text = fmt::format(
      "{} views, {} of a board: {:.3f} px off the epipolar lines (at most {:.2f}); {:.3f} % of the distance off the "
      "planes (at most {:.1f})",
      summary.views, summary.views_with_board, summary.epipolar_rms_px, limits.epipolar_px, summary.plane_percent,
      limits.plane_percent);
  if (summary.views_with_board > 0) {
    text += fmt::format("; scale {:+.3f} %, long distances {:.3f} % (at most {:.1f})", summary.scale_percent,
                        summary.long_rms_percent, limits.trueness_percent);
  } else {
    text += "; the scale was not checked, for lack of a board";
  }
  return text + fmt::format("\n{}\n", verdict(!summary.faults.empty()));
}

std::string advice(const VerifySummary& summary) {
  std::string text;
  for (const VerifyFault fault : summary.faults) {
    text += (text.empty() ? "" : ". ") + advice_for(fault, summary.scale_percent);
  }
  return text;
}

}  // namespace slsd
