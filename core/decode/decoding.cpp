// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decoding.hpp"

namespace slsd {

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
