// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

namespace slsd {

/// The text of docs/alphabet.md: the rules, the ten descriptors and the centroid of all 125 shapes, and how far apart
/// the symbols look.
[[nodiscard]] std::string alphabet_document();

/// The part of it that the decoder determines, at its end: the ten descriptors and the centroid of all 125 shapes. The
/// other parts take minutes.
[[nodiscard]] std::string descriptor_section();

}  // namespace slsd
