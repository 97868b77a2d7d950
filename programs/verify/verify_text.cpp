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
  return fmt::format(
      "{} corners, distances {:+.3f} % as a whole, long ones {:.3f} % (at most {:.1f}), the worst {:+.3f} %",
      trueness->corners, trueness->scale_percent, trueness->long_rms_percent, limits.trueness_percent,
      trueness->worst_percent);
}

/// The turn that this look cannot detect.
std::string blind_text(const ViewCheck& check) {
  if (!check.blind_axis) return "";
  Eigen::Index most = 0;
  check.blind_axis->cwiseAbs().maxCoeff(&most);
  const std::string axis = fmt::format("; one about the projector's {} axis does not show here", "xyz"[most]);
  return check.trueness ? axis + ", but in the distances" : axis + ": show it a board";
}

std::string advice_for(VerifyFault fault, double scale_percent) {
  switch (fault) {
    case VerifyFault::kEpipolar:
      return "the symbols do not lie on their epipolar lines: projector or camera were moved, turned, or focused anew; "
             "fasten them, and calibrate again";
    case VerifyFault::kPlane:
      return "what should be flat is measured bent: look at something that is flat for certain, such as glass; if it "
             "is "
             "so again, calibrate again, with poses over the whole of both images";
    case VerifyFault::kScale:
      return fmt::format(
          "all distances are {:.2f} % too {}: measure the board's ruler, and give the board by --board and "
          "the ruler by --ruler; if the board is right, calibrate again with both",
          std::abs(scale_percent), scale_percent > 0 ? "long" : "short");
    case VerifyFault::kDistances:
      break;
  }
  return "distances are wrong, each by its own share: let the board lie still and flat, and look again; if it is so "
         "again, calibrate again";
}

}  // namespace

std::string check_text(const ViewCheck& check, const VerifyLimits& limits) {
  return fmt::format(
      "{} symbols at {:.0f} mm ({} left out); off their epipolar lines by {:.3f} px (at most {:.2f}), as by a turn "
      "of {:.3f} degrees (at most {:.2f}{}); off the plane by {:.3f} mm (at most {:.3f}); {}: {}",
      check.symbols, check.distance_mm, check.left_out, check.epipolar_rms_px, limits.epipolar_px, check.turn_deg,
      limits.turn_deg, blind_text(check), check.plane_rms_mm, check.plane_limit_mm(limits),
      trueness_text(check.trueness, limits), verdict(!find_faults(check, limits).empty()));
}

std::string summary_text(const VerifySummary& summary, const VerifyLimits& limits) {
  std::string text = fmt::format(
      "{} looks, {} of them at a board: off the epipolar lines by {:.3f} px (at most {:.2f}); "
      "off the planes by {:.3f} % of the distance (at most {:.1f})",
      summary.views, summary.views_with_board, summary.epipolar_rms_px, limits.epipolar_px, summary.plane_percent,
      limits.plane_percent);
  if (summary.views_with_board > 0) {
    text += fmt::format("; distances {:+.3f} % as a whole, long ones {:.3f} % (at most {:.1f})", summary.scale_percent,
                        summary.long_rms_percent, limits.trueness_percent);
  } else {
    text += "; without a board, the scale was not checked";
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
