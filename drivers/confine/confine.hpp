// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/result.hpp"

namespace slsd {

/// Confines this process to computing, to its open descriptors, and to a limit of memory. The kernel kills it (SIGSYS)
/// if it requests anything else: a file, socket, process, signal or executable memory. That holds even if an attacker
/// controls the process. It has no capabilities and cannot gain rights. Call it in a single-threaded program, before
/// reading untrusted bytes.
///
/// A sanitizer needs further system calls: a program built with one is not confined.
/// @errors kUnsupported: the kernel has no system call filter
/// @thread thread-bound
[[nodiscard]] Result<> confine();

}  // namespace slsd
