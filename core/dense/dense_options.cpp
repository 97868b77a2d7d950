// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/dense/dense_options.hpp"

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

}  // namespace slsd
