// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace slsd {

/// Makes foreign text safe to show in an error, a log, a reply or a terminal: valid UTF-8 on one line, without control
/// characters. All text from a client, a device, a file or the network passes through here before it is quoted.
///
/// Visible escapes ("\n", "\x1b", "\u202e") replace control characters (C0, DEL, C1), and line and paragraph
/// separators. They also replace marks that change the writing direction, and bytes that are not UTF-8. All other text
/// stays unchanged, including backslashes: escapes are for reading, and cannot be undone. Text beyond the limit ends in
/// an ellipsis.
/// @param limit_bytes  limit of the result; characters and escapes stay whole
/// @thread             reentrant
[[nodiscard]] std::string printable(std::string_view foreign, std::size_t limit_bytes = 200);

}  // namespace slsd
