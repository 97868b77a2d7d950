// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/interrupt.hpp"

#include <csignal>
#include <initializer_list>

namespace slsd {
namespace {

volatile std::sig_atomic_t signalled = 0;

void on_signal(int) {
  signalled = 1;
}

}  // namespace

void Interrupt::watch() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  for (const int number : {SIGINT, SIGTERM}) ::sigaction(number, &action, nullptr);
}

bool Interrupt::came() {
  return signalled != 0;
}

}  // namespace slsd
