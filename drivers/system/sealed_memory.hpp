// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include "core/cloud/byte_sink.hpp"
#include "core/result.hpp"
#include "drivers/system/file_descriptor.hpp"

namespace slsd {

/// A memfd whose bytes and size can no longer change.
struct SealedMemory {
  FileDescriptor given;  ///< the client's descriptor, for reading and mapping
  FileDescriptor kept;   ///< our descriptor, which shows whether anybody still uses the memory
  std::size_t bytes = 0;
};

/// Writes a file into a memfd while it is computed: large pieces that are not in the processor's cache cost twice.
/// @errors kNoSpace: out of memory or descriptors; kIo
/// @thread reentrant
[[nodiscard]] Result<SealedMemory> sealed_memory(const std::function<void(ByteSink&)>& write);
[[nodiscard]] Result<SealedMemory> sealed_memory(std::string_view bytes);

/// Tells whether anybody still has the memory open or mapped. False if the kernel grants no leases: then this memory
/// cannot be watched.
/// @param kept  of sealed_memory(), after `given` was sent or closed
[[nodiscard]] bool is_held_by_others(const FileDescriptor& kept);

}  // namespace slsd
