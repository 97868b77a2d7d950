// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>

namespace slsd {

/// Writes a picture of the five sets of 25 symbols, each pixel of a symbol three pixels wide, numbers above.
/// @return false where the file cannot be written
[[nodiscard]] bool write_alphabet_picture(const std::string& file);

}  // namespace slsd
