// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

/// What the keys of [decode] say of dense clouds.
struct DenseOptions {
  int stride_px = 4;      ///< 1 to 16; the surface is fitted every so many camera pixels
  double prune_px = 1.5;  ///< 0 to 16; points this close to a hole or a jump in depth are dropped

  [[nodiscard]] Result<> validate() const;
  friend bool operator==(const DenseOptions&, const DenseOptions&) = default;
};

}  // namespace slsd
