// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

namespace slsd {

/// The text of docs/reasons.md: each rule of the decoder, what it means, and what to do about it.
[[nodiscard]] std::string reason_document();

}  // namespace slsd
