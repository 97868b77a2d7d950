// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

/// Compiles a function for the baseline and for AVX2 and picks one when the program starts, so that one package serves
/// every x86-64 machine. Sanitizers cannot follow the picking (an ifunc runs before they are set up).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SLSD_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define SLSD_CLONES
#endif
