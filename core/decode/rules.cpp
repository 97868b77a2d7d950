// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/rules.hpp"

#include <array>

namespace slsd {
namespace {

constexpr std::string_view kSeeMore =
    "Keep the object's edges out of the area you measure, or move the camera so that it sees more symbols of that "
    "surface.";
constexpr std::string_view kDisturbed =
    "Print, relief or an edge disturbs the symbol. Use a larger symbol_size_px, or coat the surface.";
constexpr std::string_view kCheckRig =
    "Check that nothing moved since the calibration; calibrate again if `slsctl status` shows a drift.";
constexpr std::string_view kSetDepth = "Set depth_min_mm and depth_max_mm so that the object lies within them.";
constexpr std::string_view kOtherLight =
    "Remove other light with a pattern, such as a second projector, a mirror or a picture of the pattern.";

using enum RuleKind;
using enum RegionStatus;

constexpr std::array<RuleText, kDecodeRuleCount> kTexts{{
    {"certain", kAccepts, kDecoded, false,
     "Its letter and those around it make its cell as certain as wrong_cells_max requires.", ""},
    {"recovered", kAccepts, kDecoded, false,
     "Its cell is certain; print, relief or an edge spoilt its shape, so its place comes from aligning its letter.",
     ""},
    {"touches_border", kRejects, kTouchesBorder, true, "The region touches the border of the frame, which may cut it.",
     "Move the object towards the middle of the frame."},
    {"too_small", kRejects, kTooSmall, true, "The region is too small for a symbol within the working depth.",
     "Move closer, or use a larger symbol_size_px."},
    {"too_large", kRejects, kTooLarge, false,
     "The region is larger than a cell: symbols merged, or it is not a symbol.",
     "Focus camera and projector; lower the exposure; shade other light."},
    {"low_contrast", kRejects, kLowContrast, true, "The region is hardly brighter than its surroundings.",
     "Raise the exposure or the projector's light; shade other light."},
    {"no_neighbour", kRejects, kNoNeighbour, false, "No links lead from it to the symbols of a window.", kSeeMore},
    {"no_window", kRejects, kNoCodeword, false, "No window around it matches the pattern on its epipolar line.",
     kSeeMore},
    {"no_letter", kRejects, kUnknownShape, false, "Its shape matches no letter of the pattern.", kDisturbed},
    {"other_letter", kRejects, kClassDisagrees, false, "Its shape matches another letter than its cell's.", kDisturbed},
    {"uncertain", kRejects, kNeighboursDisagree, false,
     "Its letter and those around it do not make its cell as certain as wrong_cells_max requires.", kSeeMore},
    {"cell_off_line", kRejects, kOffEpipolarLine, false,
     "It, or most of the surface around it, lies off its epipolar lines.", kCheckRig},
    {"cell_out_of_range", kRejects, kOutOfDepthRange, false, "Its cell would lie outside the working depth.",
     kSetDepth},
    {"split_by_edge", kRejects, kDamagedShape, true, "It differs strongly from its letter.", kDisturbed},
    {"unlike_letter", kRejects, kDamagedShape, true,
     "It differs from its letter, and symbols with cells do not surround it.", kDisturbed},
    {"cut_centre", kRejects, kDamagedShape, true,
     "It lies at a boundary, and its centre is far less certain than most.", kDisturbed},
    {"not_aligned", kRejects, kDamagedShape, true, "With precision = \"fine\": its patch does not match its letter.",
     kDisturbed},
    {"symbol_off_line", kRejects, kOffEpipolarLine, true, "Measured again, it lies off its epipolar line.", kCheckRig},
    {"symbol_out_of_range", kRejects, kOutOfDepthRange, true,
     "Measured again, its cell would lie outside the working depth.", kSetDepth},
    {"cell_twice", kRejects, kDuplicateCell, true, "Another symbol has the same cell.", kOtherLight},
    {"point_out_of_range", kRejects, kOutOfDepthRange, true, "Its point lies outside the working depth.", kSetDepth},
    {"recover_unsettled", kGuards, kDecoded, true, "Aligning it with its letter does not converge.", kDisturbed},
    {"recover_off_line", kGuards, kDecoded, true, "Aligned with its letter, it lies off its epipolar line.", kCheckRig},
    {"recover_moved", kGuards, kDecoded, true,
     "Aligned with its letter, it lies away from the place that its neighbours predict.", kSeeMore},
    {"recover_tilted", kGuards, kDecoded, true, "Aligned with its letter, it tilts against its neighbours.", kSeeMore},
    {"recover_hidden", kGuards, kDecoded, true, "Aligned with its letter, its middle does not match.", kDisturbed},
    {"recover_unlike", kGuards, kDecoded, true, "Aligned with its letter, its patch does not match.", kDisturbed},
}};

}  // namespace

const RuleText& text_of(DecodeRule rule) {
  return kTexts[static_cast<std::size_t>(rule)];
}

std::string_view to_string(RuleKind kind) {
  return kind == RuleKind::kAccepts ? "accepts" : kind == RuleKind::kRejects ? "rejects" : "guards";
}

std::string_view to_string(RegionStatus status) {
  switch (status) {
    case RegionStatus::kDecoded:
      return "decoded";
    case RegionStatus::kTooSmall:
      return "too_small";
    case RegionStatus::kTooLarge:
      return "too_large";
    case RegionStatus::kTouchesBorder:
      return "touches_border";
    case RegionStatus::kLowContrast:
      return "low_contrast";
    case RegionStatus::kUnknownShape:
      return "unknown_shape";
    case RegionStatus::kNoNeighbour:
      return "no_neighbour";
    case RegionStatus::kNoCodeword:
      return "no_codeword";
    case RegionStatus::kAmbiguousCodeword:
      return "ambiguous_codeword";
    case RegionStatus::kClassDisagrees:
      return "class_disagrees";
    case RegionStatus::kNeighboursDisagree:
      return "neighbours_disagree";
    case RegionStatus::kDamagedShape:
      return "damaged_shape";
    case RegionStatus::kOffEpipolarLine:
      return "off_epipolar_line";
    case RegionStatus::kOutOfDepthRange:
      return "out_of_depth_range";
    case RegionStatus::kDuplicateCell:
      return "duplicate_cell";
  }
  return "";
}

}  // namespace slsd
