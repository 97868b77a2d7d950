// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace slsd {

/// Foreign text, as an error, a log, a reply or a terminal may show it: valid UTF-8 on one line, without anything that
/// a terminal or a log obeys. Whatever comes from a client, a device, a file or the network goes through here before
/// it is quoted.
///
/// A control character (C0, DEL, C1), a line or paragraph separator, a mark that turns the direction of writing, and a
/// byte that is no UTF-8 become visible escapes: "\n", "\x1b", "\u202e". All other text stays as it is, a backslash
/// too: an escape is to be read, not to be undone. What is longer than the limit ends in an ellipsis.
/// @param limit_bytes  of the result; characters and escapes stay whole
/// @thread             reentrant
[[nodiscard]] std::string printable(std::string_view foreign, std::size_t limit_bytes = 200);

}  // namespace slsd
