// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace slsd {

/// Encodes bytes as text: four letters for three bytes, padded with "=" (RFC 4648, section 4).
/// @thread reentrant
[[nodiscard]] std::string to_base64(std::string_view bytes);

/// Decodes the text; nothing unless it is exactly what to_base64() makes.
/// @thread reentrant
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

}  // namespace slsd
