// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

/// From here on this process computes, reads and writes what it has open, and takes memory up to a limit; with anything
/// else that it asks of the kernel it is killed (SIGSYS): no file, socket, process, signal or executable memory,
/// whoever has taken it over. It has no capabilities and may not have new rights. Of a program with one thread, before
/// the first byte of a stranger's.
///
/// A sanitizer needs calls of its own: a program that is built with one is not confined.
/// @errors kUnsupported: the kernel filters no system calls
/// @thread thread-bound
[[nodiscard]] Result<> confine();

}  // namespace slsd
