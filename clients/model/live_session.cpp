// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/live_session.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

#include "drivers/system/interrupt.hpp"

namespace slsd::model {
namespace {

/// @return  false if the input ended, or the user ends the program
bool wait_for_line() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  for (;;) {
    if (Interrupt::came()) return false;
    if (::poll(&input, 1, 200) <= 0) continue;
    char character = 0;
    if (::read(STDIN_FILENO, &character, 1) != 1) return false;
    if (character == '\n') return true;
  }
}

}  // namespace

LiveSession::LiveSession(LiveClouds clouds, const ModelOptions& model, const LiveOptions& options, Tell tell,
                         OnCloud on_cloud)
    : clouds_(std::move(clouds)),
      builder_(clouds_.calibration(), model),
      options_(options),
      tell_(std::move(tell)),
      on_cloud_(std::move(on_cloud)) {}

Result<> LiveSession::follow() {
  Result<> ended = options_.views > 0 ? follow_turntable() : follow_object();
  if (std::exchange(progress_, false)) std::fputs("\n", stderr);
  if (!ended) return ended;
  return clouds_.finish();
}

Result<Model> LiveSession::finish(const Advance& advance) {
  return builder_.finish([this](const std::string& name) { return clouds_.read(name); }, tell_, advance);
}

bool LiveSession::enough(const SeenSides& sides) const {
  if (Interrupt::came()) return true;
  if (options_.seconds && std::chrono::duration<double>(Clock::now() - begin_).count() >= *options_.seconds)
    return true;
  return options_.until_closed && builder_.closed(sides);
}

Result<> LiveSession::follow_object() {
  say("turn the object; Ctrl-C ends, and writes the model");
  if (auto asked = clouds_.request(); !asked) return asked;
  for (;;) {
    const auto ply = clouds_.receive();
    if (!ply) return tl::unexpected(ply.error());
    // The service takes the next cloud while this one is placed.
    if (auto asked = clouds_.request(); !asked) return asked;
    const auto sides = add(*ply);
    if (!sides) return tl::unexpected(sides.error());
    show_progress(*sides);
    if (!enough(*sides)) continue;
    (void)clouds_.receive();
    return {};
  }
}

Result<> LiveSession::follow_turntable() {
  say("turn to the first view, then press Enter");
  for (int view = 1; view <= options_.views && !input_ended_; ++view) {
    if (auto scanned = scan_view(view); !scanned) return scanned;
    if (view < options_.views && !input_ended_)
      say(fmt::format("view {} of {} is placed; turn by {:.0f} degrees, then press Enter", view, options_.views,
                      360.0 / options_.views));
  }
  return {};
}

/// Scans at each line until the view is placed, or the input ends.
Result<> LiveSession::scan_view(int view) {
  for (const std::size_t before = builder_.placed(); builder_.placed() == before;) {
    input_ended_ = !wait_for_line();
    if (input_ended_) return {};
    if (auto asked = clouds_.request(); !asked) return asked;
    const auto ply = clouds_.receive();
    if (!ply) return tl::unexpected(ply.error());
    if (auto sides = add(*ply); !sides) return tl::unexpected(sides.error());
    if (builder_.placed() == before)
      say(fmt::format("view {} of {} was not placed: press Enter to scan it again", view, options_.views));
  }
  return {};
}

Result<SeenSides> LiveSession::add(const std::optional<std::string>& ply) {
  std::string refusal = ply ? "" : clouds_.problem();
  if (ply) {
    auto name = clouds_.keep(*ply);
    if (!name) return tl::unexpected(name.error());
    const auto added = builder_.add(*name, *ply);
    if (!added) return tl::unexpected(added.error());
    refusal = added->refusal;
  }
  // A hand in the way spoils many clouds for one reason: it is said once.
  const bool turntable = options_.views > 0;
  if (!refusal.empty() && (reason_.empty() || turntable)) say("left out: " + refusal);
  if (refusal.empty() && !reason_.empty() && !turntable) say("found the object again");
  reason_ = std::move(refusal);
  SeenSides sides = builder_.sides();
  on_cloud_(builder_, sides, reason_);
  return sides;
}

void LiveSession::say(const std::string& sentence) {
  if (std::exchange(progress_, false)) std::fputs("\n", stderr);
  tell_(sentence);
}

/// Rewrites a line on a terminal; elsewhere adds one for each 30 degrees.
void LiveSession::show_progress(const SeenSides& sides) {
  const std::string text = fmt::format("{} clouds; {}", builder_.placed(), to_string(sides));
  if (::isatty(STDERR_FILENO) != 0) {
    std::fprintf(stderr, "\r%-100s", text.c_str());
    progress_ = true;
    return;
  }
  const int sectors = static_cast<int>(sides.seen_degrees) / 30;
  if (sectors > told_) say(text);
  told_ = std::max(told_, sectors);
}

}  // namespace slsd::model
