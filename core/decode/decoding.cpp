// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decoding.hpp"

namespace slsd {

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

std::string_view to_string(Stage stage) {
  switch (stage) {
    case Stage::kBinarize:
      return "binarize";
    case Stage::kFindRegions:
      return "find_regions";
    case Stage::kDescribe:
      return "describe";
    case Stage::kClassify:
      return "classify";
    case Stage::kLinkGrid:
      return "link_grid";
    case Stage::kDecodeWindows:
      return "decode_windows";
    case Stage::kReview:
      return "review";
    case Stage::kCorrespond:
      return "correspond";
    case Stage::kAlign:
      return "align";
    case Stage::kTriangulate:
      return "triangulate";
  }
  return "";
}

}  // namespace slsd
