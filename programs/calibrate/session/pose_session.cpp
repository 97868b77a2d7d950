// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/pose_session.hpp"

#include <numeric>

#include <fmt/format.h>

#include "programs/calibrate/session/guide/coverage_text.hpp"
#include "programs/calibrate/session/guide/view_text.hpp"

namespace slsd {
namespace {

constexpr double kStillPx = 0.3;  // movement between two views
constexpr double kGonePx = 5;     // movement that makes a handled pose a new one

/// The board's place in the projector's image, because the operator looks at the board.
std::optional<Eigen::Vector2d> lit_place(const std::vector<PoseView>& views) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  std::size_t count = 0;
  for (const PoseView& view : views) {
    for (const ProjectedPoint& symbol : view.symbols) sum += symbol.projector_px, ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<double>(count);
}

std::string counts_text(const std::vector<PoseView>& views) {
  const auto total = [&](auto member) {
    return std::accumulate(views.begin(), views.end(), std::size_t{0},
                           [&](std::size_t sum, const PoseView& view) { return sum + (view.*member).size(); });
  };
  return fmt::format("{} corners, {} symbols", total(&PoseView::corners), total(&PoseView::symbols));
}

}  // namespace

PoseSession::PoseSession(PoseSessionParts parts, const PoseSessionOptions& options)
    : parts_(std::move(parts)),
      options_(options),
      begun_(options.begun),
      sign_centre_px_(0.5 * parts_.source.projector().width_px, 0.5 * parts_.source.projector().height_px) {}

Result<> PoseSession::run() {
  tell_at_ = parts_.time.now() + options_.timeout;
  parts_.terminal.say("next: " + parts_.poses.most_helpful());
  while (parts_.poses.size() < options_.poses && !parts_.interrupted()) {
    if (auto gone_on = step(); !gone_on) return gone_on;
  }
  return {};
}

Result<> PoseSession::step() {
  auto view = parts_.taker.look();
  if (!view) return bear(view.error());
  bear_until_.reset();
  if (!sized_) {
    if (auto sizes = parts_.poses.set_sizes(view->pictures); !sizes) return sizes;
  }
  begun_ = sized_ = true;
  const double moved = moved_px(last_, view->sightings);
  if (handled_ && is_seen(view->sightings) && !(moved_px(*handled_, view->sightings) < kGonePx)) handled_.reset();
  watch_for_board(view->sightings);
  show_state(view->sightings, moved);
  last_ = std::move(view->sightings);
  if (!(moved < kStillPx) || handled_ || parts_.time.now() < next_attempt_) return {};
  return attempt(last_);
}

/// Failing devices are reopened; a long failure ends the session.
Result<> PoseSession::bear(const Error& error) {
  if (!begun_) return tl::unexpected(error);
  const MonotonicTime now = parts_.time.now();
  if (!bear_until_) {
    parts_.terminal.say("no pictures: " + to_string(error) + "; trying again");
    bear_until_ = now + options_.timeout;
  }
  if (now >= *bear_until_) return tl::unexpected(error);
  parts_.time.sleep(options_.retry);
  return {};
}

void PoseSession::watch_for_board(const BoardSightings& sightings) {
  const MonotonicTime now = parts_.time.now();
  if (is_seen(sightings)) {
    tell_at_ = now + options_.timeout;
  } else if (now >= tell_at_) {
    parts_.terminal.say(
        fmt::format("no {0} in view for {1} s: hold it where the projector lights it and a camera sees it, and check "
                    "that --{0} names the one you hold{2}",
                    parts_.poses.subject() == PoseSubject::kBoard ? "board" : "plane", options_.timeout.count(),
                    unseen_text(sightings, parts_.source.cameras())));
    tell_at_ = now + options_.timeout;
  }
}

void PoseSession::show_state(const BoardSightings& sightings, double moved) {
  const std::string state = !is_seen(sightings)   ? "no board"
                            : !(moved < kStillPx) ? "moving"
                            : handled_            ? "done"
                                                  : "still";
  const bool is_board = parts_.poses.subject() == PoseSubject::kBoard;
  const std::string next = is_board ? "show another pose" : "hold the plane in another place";
  parts_.terminal.live(
      fmt::format("{} {} of {}: {} ({})", is_board ? "pose" : "plane", parts_.poses.size() + 1, options_.poses,
                  state == "done" ? next : state, view_text(sightings, parts_.source.cameras())),
      state);
  parts_.progress({state, {}, options_.poses, parts_.poses, sightings});
}

Result<> PoseSession::attempt(const BoardSightings& sightings) {
  if (const std::string same = parts_.poses.same_as(sightings); !same.empty()) {
    handled_ = sightings;
    refuse(fmt::format("same as {}; {}", same, parts_.poses.most_helpful()));
    return {};
  }
  show(Sign::kHold);
  auto before = parts_.taker.look();
  if (!before) return bear(before.error());
  // The board moved at the sign: no message is needed.
  if (!(moved_px(sightings, before->sightings) < kStillPx)) return {};
  BoardSightings held = before->sightings;
  auto trial = parts_.taker.take(std::move(*before), parts_.poses);
  if (!trial) return bear(trial.error());
  if (!trial->refused()) return keep(std::move(*trial), std::move(held));
  refuse(trial->why());
  next_attempt_ = parts_.time.now() + options_.after_refusal;
  return {};
}

Result<> PoseSession::keep(PoseTrial trial, BoardSightings sightings) {
  const auto name = parts_.recorder.keep(parts_.poses.subject(), trial.pictures, trial.views);
  if (!name) return tl::unexpected(name.error());
  handled_ = std::move(sightings);
  sign_centre_px_ = lit_place(trial.views).value_or(sign_centre_px_);
  std::string text = fmt::format("{}: taken: {}, processed in {:.2f} s", *name, counts_text(trial.views),
                                 std::chrono::duration<double>(trial.work).count());
  for (const std::string& lack : trial.lacks) text += "\n  without " + lack;
  for (const std::string& advice : trial.advice) text += "\n  " + advice;
  parts_.poses.add({*name, std::move(trial.views), parts_.poses.subject()});
  const std::size_t have = parts_.poses.size();
  text += "\n" + coverage_text(parts_.poses.observations());
  text += have >= options_.poses ? std::string("all poses are taken")
                                 : fmt::format("{} more; next: {}", options_.poses - have, parts_.poses.most_helpful());
  parts_.terminal.say(text);
  show(Sign::kTaken);
  return {};
}

void PoseSession::refuse(const std::string& why) {
  parts_.terminal.say("not taken: " + why);
  show(Sign::kAgain, why);
}

void PoseSession::show(Sign sign, const std::string& why) {
  const std::string_view state = sign == Sign::kHold ? "hold" : sign == Sign::kTaken ? "taken" : "again";
  parts_.progress({state, why, options_.poses, parts_.poses, last_});
  parts_.source.show(draw_sign(sign, parts_.source.projector(), sign_centre_px_));
  parts_.time.sleep(options_.sign);
}

}  // namespace slsd
