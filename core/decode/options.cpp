// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/options.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace slsd {

Result<> DenseOptions::validate() const {
  if (stride_px < 1 || stride_px > 16) {
    return fail(ErrorCode::kInvalidArgument, "dense_stride_px must be 1 to 16, not " + std::to_string(stride_px),
                "decode.dense_stride_px");
  }
  if (!(prune_px >= 0 && prune_px <= 16)) {
    return fail(ErrorCode::kInvalidArgument, "dense_prune_px must be 0 to 16", "decode.dense_prune_px");
  }
  return {};
}

Result<> DecodeOptions::validate() const {
  if (!(depth_min_mm > 0))
    return fail(ErrorCode::kInvalidArgument, "depth_min_mm must be greater than 0", "decode.depth_min_mm");
  if (!(depth_max_mm > depth_min_mm) || !std::isfinite(depth_max_mm)) {
    return fail(ErrorCode::kInvalidArgument, "depth_max_mm must be greater than depth_min_mm, and finite",
                "decode.depth_max_mm");
  }
  if (!(wrong_cells_max >= 1e-9 && wrong_cells_max <= 1)) {
    return fail(ErrorCode::kInvalidArgument, "wrong_cells_max must be 1e-9 to 1 wrong cells per frame on average",
                "decode.wrong_cells_max");
  }
  if (precision == Precision::kFine && centre == Method::kPaper) {
    return fail(ErrorCode::kInvalidArgument,
                "precision = \"fine\" aligns symbols and does not use centroids; leave centre at \"default\"",
                "decode.precision");
  }
  return dense.validate();
}

double DecodeOptions::middle_depth_mm() const {
  return std::sqrt(depth_min_mm * depth_max_mm);
}

bool DecodeOptions::any_paper() const {
  const Method stages[] = {binarize, find_regions, classify, centre, link_grid, decode_windows, correspond};
  return std::ranges::find(stages, Method::kPaper) != std::end(stages);
}

}  // namespace slsd
