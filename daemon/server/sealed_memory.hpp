// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string_view>

#include "core/result.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// A memfd that holds the bytes and can neither change nor shrink nor grow.
/// @errors kNoSpace, kIo
/// @thread reentrant
[[nodiscard]] Result<FileDescriptor> sealed_memory(std::string_view bytes);

}  // namespace slsd
