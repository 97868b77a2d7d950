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
    "Check that nothing was moved since the calibration; calibrate again if `slsctl status` shows a drift.";
constexpr std::string_view kSetDepth = "Set depth_min_mm and depth_max_mm so that the object lies within them.";
constexpr std::string_view kOtherLight =
    "Remove other light with a pattern, such as a second projector, a mirror or a picture of the pattern.";

using enum RuleKind;
using enum RegionStatus;

constexpr std::array<RuleText, kDecodeRuleCount> kTexts{{
    {"windows", kAccepts, kDecoded, false, "The windows around it name its cell, and nothing speaks against it.", ""},
    {"grown", kAccepts, kDecoded, true, "No window names it; its neighbours put it on a cell whose letter it shows.",
     ""},
    {"held_again", kAccepts, kDecoded, true, "It was unlike its letter, but two decoded symbols of its island hold it.",
     ""},
    {"mended_by_two", kAccepts, kDecoded, true, "Aligned with its letter it agrees, where two neighbours put it.", ""},
    {"mended_by_one", kAccepts, kDecoded, true,
     "Aligned with its letter it agrees closely, where one neighbour puts it.", ""},
    {"mended_at_corner", kAccepts, kDecoded, true,
     "Aligned with its letter it agrees, tilted as a surface may be at a corner.", ""},
    {"mended_in_group", kAccepts, kDecoded, true,
     "It and two or more beside it, none of which stood, agree with a plane of the grid.", ""},
    {"touches_border", kRejects, kTouchesBorder, true, "The region touches the border of the frame, which may cut it.",
     "Move the object towards the middle of the frame."},
    {"too_small", kRejects, kTooSmall, true, "The region is too small for a symbol within the working depth.",
     "Come nearer, or use a larger symbol_size_px."},
    {"too_large", kRejects, kTooLarge, false,
     "The region is larger than a cell: symbols ran together, or it is no symbol.",
     "Focus camera and projector; lower the exposure; shade other light."},
    {"low_contrast", kRejects, kLowContrast, true, "The region is hardly brighter than what is around it.",
     "Raise the exposure or the projector's light; shade other light."},
    {"no_neighbour", kRejects, kNoNeighbour, false, "No links lead from it to the symbols of a window.", kSeeMore},
    {"no_window", kRejects, kNoCodeword, false,
     "No window around it is in the pattern where its epipolar line allows it.", kSeeMore},
    {"windows_disagree", kRejects, kAmbiguousCodeword, true,
     "The windows around it name different cells, and none has twice the votes.", kSeeMore},
    {"weak_island", kRejects, kNoCodeword, true,
     "The linked symbols around it are too few to be certain against chance.", kSeeMore},
    {"island_elsewhere", kRejects, kAmbiguousCodeword, true,
     "The linked symbols around it fit another place of the pattern, too.", kSeeMore},
    {"island_off_line", kRejects, kOffEpipolarLine, true,
     "Most of the linked symbols around it lie off their epipolar lines.", kCheckRig},
    {"island_twice", kRejects, kDuplicateCell, true,
     "Another group of symbols in the frame shows the same part of the pattern.", kOtherLight},
    {"no_letter", kRejects, kUnknownShape, true, "Its shape is like no letter of the pattern.", kDisturbed},
    {"other_letter", kRejects, kClassDisagrees, true, "Its shape is another letter's than its cell's.", kDisturbed},
    {"cell_off_line", kRejects, kOffEpipolarLine, true, "It lies off its cell's epipolar line.", kCheckRig},
    {"cell_out_of_range", kRejects, kOutOfDepthRange, true, "Its cell would lie outside the working depth.", kSetDepth},
    {"slid", kRejects, kNeighboursDisagree, true,
     "Its row or column fits the pattern better some cells on, as another surface shows it.", kSeeMore},
    {"line_misread", kRejects, kNeighboursDisagree, true,
     "It shows another letter than its cell's, and the line through it is not certain by itself.", kSeeMore},
    {"line_contradicted", kRejects, kNeighboursDisagree, true,
     "A contradiction ends the line through it, which is not certain by itself.", kSeeMore},
    {"line_weak", kRejects, kNeighboursDisagree, true,
     "The line through it agrees with the pattern much less than lines do.", kSeeMore},
    {"line_off_grid", kRejects, kNeighboursDisagree, true,
     "The line through it agrees poorly and lies beside the grid of its island.", kSeeMore},
    {"line_repeats", kRejects, kNeighboursDisagree, true,
     "The line through it has a misread symbol, and its letters come again along the epipolar line.", kSeeMore},
    {"line_off_epipolar", kRejects, kNeighboursDisagree, true,
     "The line through it lies off its epipolar lines by one distance.", kCheckRig},
    {"held_by_few", kRejects, kNeighboursDisagree, true, "Fewer than two links more hold it than contradict it.",
     kSeeMore},
    {"piece_contradicted", kRejects, kNeighboursDisagree, true,
     "A piece of the rim may be another surface's: something beside it contradicts.", kSeeMore},
    {"piece_doubtful", kRejects, kNeighboursDisagree, true,
     "A piece of the rim may be another surface's: doubtful symbols lie beside it.", kSeeMore},
    {"piece_bent", kRejects, kNeighboursDisagree, true,
     "A piece of the rim may be another surface's: the links that hold it are bent.", kSeeMore},
    {"notch", kRejects, kNeighboursDisagree, true,
     "It is left beside what was cut, and the rim is straighter without it.", kSeeMore},
    {"step", kRejects, kNeighboursDisagree, true, "Too few symbols that agree lie between it and a contradiction.",
     kSeeMore},
    {"torn", kRejects, kDamagedShape, true, "It is far from its letter, wherever it lies.", kDisturbed},
    {"unlike_letter", kRejects, kDamagedShape, true,
     "It is unlike its letter, and not surrounded by symbols with cells.", kDisturbed},
    {"hidden", kRejects, kDamagedShape, true, "Its middle is brighter than its letter: something lies before it.",
     kDisturbed},
    {"cut_centre", kRejects, kDamagedShape, true, "At a rim, and its centre is far less certain than most.",
     kDisturbed},
    {"not_aligned", kRejects, kDamagedShape, true,
     "With precision = \"fine\": its patch does not agree with its letter.", kDisturbed},
    {"refused_around", kRejects, kNeighboursDisagree, true, "At a rim, and more beside it was refused than stands.",
     kSeeMore},
    {"corner_misread", kRejects, kNeighboursDisagree, true, "It lies in the corner between two misread symbols.",
     kSeeMore},
    {"corner_at_border", kRejects, kNeighboursDisagree, true,
     "It lies in the corner between the frame's border and what was refused.", kSeeMore},
    {"alone", kRejects, kNeighboursDisagree, true, "No symbol beside it stands.", kSeeMore},
    {"last_of_line", kRejects, kNeighboursDisagree, true,
     "It is the last of a refused line, beside what contradicts it.", kSeeMore},
    {"left_of_line", kRejects, kNeighboursDisagree, true, "Of its line, three to each side were refused.", kSeeMore},
    {"rest_of_line", kRejects, kNeighboursDisagree, true,
     "Few are left of its line, with nothing of their island on one side.", kSeeMore},
    {"on_torn_line", kRejects, kNeighboursDisagree, true, "Of its line, more symbols are torn or misread than stand.",
     kSeeMore},
    {"bridge", kRejects, kNeighboursDisagree, true, "It is the only one left of a torn line between two that stand.",
     kSeeMore},
    {"pair", kRejects, kNeighboursDisagree, true, "It and one other have only each other.", kSeeMore},
    {"other_light", kRejects, kNeighboursDisagree, true,
     "On its line as many symbols show light of another surface as stand.", kSeeMore},
    {"left_alone", kRejects, kNeighboursDisagree, true,
     "What stood beside it was refused for light of another surface.", kSeeMore},
    {"other_at_border", kRejects, kNeighboursDisagree, true,
     "The symbol beside it, which the frame's border cuts, shows another letter than the pattern.", kSeeMore},
    {"symbol_off_line", kRejects, kOffEpipolarLine, true, "Measured again, it lies off its epipolar line.", kCheckRig},
    {"symbol_out_of_range", kRejects, kOutOfDepthRange, true,
     "Measured again, its cell would lie outside the working depth.", kSetDepth},
    {"cell_twice", kRejects, kDuplicateCell, true, "Another symbol has the same cell, with as good or better evidence.",
     kOtherLight},
    {"point_out_of_range", kRejects, kOutOfDepthRange, true, "Its point lies outside the working depth.", kSetDepth},
    {"mend_disputed", kGuards, kDecoded, true, "A well seen symbol near it contradicts.", kSeeMore},
    {"mend_unsettled", kGuards, kDecoded, true, "Aligned with its letter it does not settle.", kDisturbed},
    {"mend_off_line", kGuards, kDecoded, true, "Aligned with its letter it lies off its epipolar line.", kCheckRig},
    {"mend_moved", kGuards, kDecoded, true,
     "Aligned with its letter it lies beside the place where its neighbours put it.", kSeeMore},
    {"mend_tilted", kGuards, kDecoded, true, "Aligned with its letter it is tilted against its neighbours.", kSeeMore},
    {"mend_hidden", kGuards, kDecoded, true, "Aligned with its letter its middle does not agree.", kDisturbed},
    {"mend_unlike", kGuards, kDecoded, true, "Aligned with its letter its patch does not agree.", kDisturbed},
    {"mend_alone", kGuards, kDecoded, true, "One symbol holds it, and it fits the grid too loosely for one.", kSeeMore},
    {"group_disputed", kGuards, kDecoded, true, "What lies around its group contradicts, or is the frame's border.",
     kSeeMore},
    {"group_misplaced", kGuards, kDecoded, true, "It lies beside the plane of its group, or is tilted against it.",
     kSeeMore},
    {"group_unlike", kGuards, kDecoded, true, "Aligned on the plane of its group its patch does not agree.",
     kDisturbed},
    {"group_line_alone", kGuards, kDecoded, true, "One of its group holds it, and nothing along its line has a cell.",
     kSeeMore},
    {"group_torn_line", kGuards, kDecoded, true, "Too many of its line show light of another surface.", kSeeMore},
    {"group_too_few", kGuards, kDecoded, true, "Fewer than three that agree lie beside each other.", kSeeMore},
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
