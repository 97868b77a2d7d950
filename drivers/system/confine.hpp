// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

/// Confines this process to computing, to reading and writing what it has open, and to memory up to a limit. The kernel
/// kills it (SIGSYS) if it asks for anything else: a file, socket, process, signal or executable memory, whoever has
/// taken it over. It has no capabilities and may not have new rights. Call it in a program with one thread, before the
/// first byte of a stranger's.
///
/// A sanitizer needs calls of its own: a program that is built with one is not confined.
/// @errors kUnsupported: the kernel filters no system calls
/// @thread thread-bound
[[nodiscard]] Result<> confine();

}  // namespace slsd
