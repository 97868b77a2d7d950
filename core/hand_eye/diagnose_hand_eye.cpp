// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/hand_eye/diagnose_hand_eye.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "core/hand_eye/first_places.hpp"

namespace slsd {
namespace {

using Fault = HandEyeFinding::Fault;

constexpr std::size_t kPosesMin = 3;
constexpr double kFaultShare = 0.01;              // of records, for each fault
constexpr double kClearly = 5;                    // logarithm of how much likelier a fault must be than none
constexpr std::size_t kTried = 4;                 // readings that are adjusted, of those that fit best in closed form
constexpr double kMeasuredMm = 15;                // one standard deviation of a place by a ruler
constexpr double kTakenMm = 250;                  // how far a tool usually is from the flange
constexpr double kRobotMm = 3, kRobotRad = 0.02;  // no robot is worse
constexpr double kOneTurnDegrees = 10, kOneAxisShare = 0.15;  // of poses that turn about one axis only
constexpr double kTurnsMinDegrees = 3;             // about a second axis; with less, nothing else can be told
constexpr double kFewRad = 1e-4, kFewPlaceMm = 1;  // least noise of a closed form

double degrees(double rad) {
  return rad * 180 / std::numbers::pi;
}

/// A hypothesis, adjusted.
struct Hypothesis {
  PoseReading reading;
  HandEyeSession session;
  HandEyeModel model;
  HandEyeFit fit;
  double score = 0;  ///< evidence and prior
};

double log_density(const Eigen::Vector3d& value, double sigma) {
  return -0.5 * value.squaredNorm() / (sigma * sigma) - 3 * std::log(sigma) - 1.5 * std::log(2 * std::numbers::pi);
}

/// Kinds of moves, and one standard deviation of their coordinates.
struct MoveKind {
  double turn_rad, shift_mm;
  bool tool;  ///< another point of the arm was recorded
};
constexpr MoveKind kMoves[] = {
    {0.005, 2, false}, {0.03, 15, false}, {kMovedRad, kMovedMm, false}, {0.003, kTakenMm, true}, {1, kTakenMm, true}};

struct Move {
  Eigen::Vector3d turn_rad, shift_mm;
};

Move move_between(const RigidTransform& before, const RigidTransform& after) {
  const Eigen::AngleAxisd turn(after.rotation * before.rotation.transpose());
  return {turn.angle() * turn.axis(), after.translation - before.translation};
}

double log_density(const Move& move, const MoveKind& kind) {
  return log_density(move.turn_rad, kind.turn_rad) + log_density(move.shift_mm, kind.shift_mm);
}

/// The likeliest kind. Only what rides on the arm moves with a tool.
const MoveKind& kind_of(const Move& move, bool on_arm) {
  const MoveKind* best = nullptr;
  for (const MoveKind& kind : kMoves) {
    if (kind.tool && !on_arm) continue;
    if (best == nullptr || log_density(move, kind) > log_density(move, *best)) best = &kind;
  }
  return *best;
}

Move move_of(const HandEyeFit& fit, bool scanner) {
  return scanner ? move_between(fit.places.mount_from_rig, *fit.mount_from_rig_after)
                 : move_between(fit.places.stand_from_board, *fit.stand_from_board_after);
}

bool rides(Mounted mounted, bool scanner) {
  return scanner == (mounted == Mounted::kArm);
}

/// Logarithm of the ratio of a move's density by its kind to that by the adjustment's wide prior.
double log_gain_of_kind(const Hypothesis& hypothesis) {
  if (!hypothesis.model.scanner_moved && !hypothesis.model.board_moved) return 0;
  const bool scanner = hypothesis.model.scanner_moved.has_value();
  const Move move = move_of(hypothesis.fit, scanner);
  const MoveKind& kind = kind_of(move, rides(hypothesis.session.mounted, scanner));
  return log_density(move, kind) - log_density(move, {kMovedRad, kMovedMm, false});
}

double log_prior_of(const PoseReading& reading, const HandEyeRecord& record) {
  double faults = static_cast<double>(differences(record, reading).size());
  double prior = faults * std::log(kFaultShare);
  const bool shuffled =
      !reading.order.empty() && std::ranges::find(reading.order, PoseReading::kNoLine) == reading.order.end();
  if (shuffled) prior -= std::lgamma(static_cast<double>(reading.order.size()) + 1);
  return prior;
}

/// Score of a session by its closed form: how far robot and board disagree in turn and place.
double quick_score(const HandEyeSession& session) {
  std::vector<const HandEyeView*> views;
  for (const HandEyeView& view : session.views) views.push_back(&view);
  const HandEyePlaces places = first_places(session.mounted, views);
  double turns = 0, shifts = 0;
  for (const HandEyeView* view : views) {
    const RigidTransform by_robot = places.mount_from_rig.inverse()
                                        .after(mount_from_stand(session.mounted, view->base_from_flange))
                                        .after(places.stand_from_board);
    const RigidTransform& seen = view->board.rig_from_board;
    turns += std::pow(Eigen::AngleAxisd(by_robot.rotation.transpose() * seen.rotation).angle(), 2);
    shifts += (by_robot * view->board.middle_mm - seen * view->board.middle_mm).squaredNorm();
  }
  const auto count = static_cast<double>(views.size());
  return -1.5 * count *
         (std::log(turns / count + kFewRad * kFewRad) + std::log(shifts / count + kFewPlaceMm * kFewPlaceMm));
}

Hypothesis adjusted(const HandEyeRecord& record, const PoseReading& reading, HandEyeSession session, HandEyeModel model,
                    double log_prior) {
  Hypothesis hypothesis{reading, std::move(session), std::move(model), {}, 0};
  hypothesis.fit = fit_hand_eye(hypothesis.session, hypothesis.model);
  hypothesis.score = hypothesis.fit.evidence + log_prior + log_prior_of(reading, record) + log_gain_of_kind(hypothesis);
  if (!std::isfinite(hypothesis.score)) hypothesis.score = -1e9;
  return hypothesis;
}

HandEyeModel without_lines(const PoseReading& reading) {
  HandEyeModel model;
  for (std::size_t i = 0; i < reading.order.size(); ++i)
    if (reading.order[i] == PoseReading::kNoLine) model.left_out.push_back(i);
  return model;
}

/// The told order, or each pose one view earlier or later, or sorted by the turns.
std::vector<PoseReading> other_orders(const HandEyeRecord& record, const HandEyeSession& told) {
  const std::size_t count = record.views.size();
  PoseReading later = as_told(record), earlier = later, sorted = later;
  for (std::size_t i = 0; i < count; ++i) {
    later.order.push_back(i > 0 ? i - 1 : PoseReading::kNoLine);
    earlier.order.push_back(i + 1 < count ? i + 1 : PoseReading::kNoLine);
  }
  sorted.order = order_by_turns(told);
  std::vector<PoseReading> readings;
  if (count > kPosesMin) readings = {later, earlier};
  if (!sorted.order.empty()) readings.push_back(sorted);
  return readings;
}

/// Readings worth adjusting, adjusted; the likeliest first.
Result<std::vector<Hypothesis>> adjust_readings(const HandEyeRecord& record) {
  std::vector<Hypothesis> adjusted_ones;
  const auto told = read_session(record, as_told(record));
  if (told) {
    adjusted_ones.push_back(adjusted(record, as_told(record), *told, {}, 0));
    for (const PoseReading& reading : other_orders(record, *told)) {
      auto session = read_session(record, reading);
      if (session) adjusted_ones.push_back(adjusted(record, reading, std::move(*session), without_lines(reading), 0));
    }
  }
  struct Candidate {
    PoseReading reading;
    HandEyeSession session;
    double score;
  };
  std::vector<Candidate> candidates;
  for (const PoseReading& reading : other_readings(record)) {
    auto session = read_session(record, reading);
    if (!session) continue;
    const double score = quick_score(*session) + log_prior_of(reading, record);
    candidates.push_back({reading, std::move(*session), score});
  }
  std::ranges::sort(candidates, std::greater<>(), &Candidate::score);
  for (std::size_t i = 0; i < std::min(kTried, candidates.size()); ++i)
    adjusted_ones.push_back(adjusted(record, candidates[i].reading, std::move(candidates[i].session), {}, 0));
  if (adjusted_ones.empty()) return tl::unexpected(told.error());
  std::ranges::stable_sort(adjusted_ones, std::greater<>(), &Hypothesis::score);
  return adjusted_ones;
}

/// The likeliest of what may have happened in a session.
class Events {
 public:
  Events(const HandEyeRecord& record, Hypothesis plain) : record_(record), plain_(plain), best_(std::move(plain)) {}

  Hypothesis find() {
    const std::size_t count = plain_.session.views.size();
    if (count > kPosesMin) {
      HandEyeModel late;
      late.late = true;
      try_model(late, std::log(kFaultShare));
      for (std::size_t k = 1; k < count; ++k) {
        const double prior = std::log(kFaultShare / static_cast<double>(count - 1));
        HandEyeModel scanner, board;
        scanner.scanner_moved = board.board_moved = k;
        try_model(scanner, prior);
        try_model(board, prior);
      }
      leave_out();
    }
    return best_;
  }

 private:
  void try_model(const HandEyeModel& model, double log_prior) {
    Hypothesis hypothesis = adjusted(record_, plain_.reading, plain_.session, model, log_prior);
    if (hypothesis.score > best_.score) best_ = std::move(hypothesis);
  }

  // One after the other, the view whose absence helps most, while enough are left.
  void leave_out() {
    const std::size_t count = plain_.session.views.size();
    Hypothesis now = plain_;
    for (std::size_t out = 1; out <= count / 3 && count - out >= kPosesMin; ++out) {
      std::optional<Hypothesis> next;
      for (std::size_t i = 0; i < count; ++i) {
        if (std::ranges::find(now.model.left_out, i) != now.model.left_out.end()) continue;
        HandEyeModel model = now.model;
        model.left_out.push_back(i);
        Hypothesis hypothesis = adjusted(record_, plain_.reading, plain_.session, model, 0);
        if (!next || hypothesis.score > next->score) next = std::move(hypothesis);
      }
      if (!next || next->score < now.score - kClearly) break;
      now = std::move(*next);
      if (now.score > best_.score) best_ = now;
    }
  }

  const HandEyeRecord& record_;
  Hypothesis plain_, best_;
};

HandEyeFinding move_finding(const Hypothesis& hypothesis, bool scanner) {
  const std::size_t first = scanner ? *hypothesis.model.scanner_moved : *hypothesis.model.board_moved;
  const std::string& from = hypothesis.session.views[first].name;
  const Move move = move_of(hypothesis.fit, scanner);
  const std::string size = fmt::format("{:.1f} mm and {:.2f}°", move.shift_mm.norm(), degrees(move.turn_rad.norm()));
  if (kind_of(move, rides(hypothesis.session.mounted, scanner)).tool) {
    return {Fault::kTool, fmt::format("from {} on, the poses are of another point of the arm, {} away: record every "
                                      "pose of the flange, none of a tool",
                                      from, size)};
  }
  return {scanner ? Fault::kScannerKnocked : Fault::kBoardMoved,
          fmt::format("from {} on, the {} is elsewhere, by {}: fasten it, and begin again", from,
                      scanner ? "scanner" : "board", size)};
}

void add_left_out(const HandEyeRecord& record, const Hypothesis& hypothesis, std::vector<HandEyeFinding>& findings) {
  for (const std::size_t view : hypothesis.model.left_out) {
    if (!hypothesis.reading.order.empty()) return;  // they have no pose in this order
    const auto same = [&](const RecordedView& other) {
      return other.name != record.views[view].name && other.pose == record.views[view].pose;
    };
    const auto twin = std::ranges::find_if(record.views, same);
    const std::string& name = record.views[view].name;
    if (twin != record.views.end()) {
      findings.push_back({Fault::kCopied, fmt::format("{} has a copy of the pose of {}, but another picture: leave it "
                                                      "out, or record its own pose",
                                                      name, twin->name)});
    } else {
      const ViewResidual& off = hypothesis.fit.residuals[view];
      findings.push_back(
          {Fault::kStray, fmt::format("{} contradicts the others, by {:.1f} mm and {:.2f}°: leave it out", name,
                                      off.shift_mm.norm(), degrees(off.turn_rad.norm()))});
    }
  }
}

void add_events(const HandEyeRecord& record, const Hypothesis& hypothesis, std::vector<HandEyeFinding>& findings) {
  if (hypothesis.model.scanner_moved) findings.push_back(move_finding(hypothesis, true));
  if (hypothesis.model.board_moved) findings.push_back(move_finding(hypothesis, false));
  if (hypothesis.model.late) {
    double share = 0;
    for (const double late : hypothesis.fit.lateness)
      share += late / static_cast<double>(hypothesis.fit.lateness.size());
    findings.push_back({Fault::kLate, fmt::format("the poses are late: the robot had {:.0f} % of the way still to go; "
                                                  "wait until it stands, then read its pose",
                                                  100 * share)});
  }
  add_left_out(record, hypothesis, findings);
}

/// Compares the place by the fit with that by a ruler.
void add_tool(const HandEyeRecord& record, const Hypothesis& hypothesis, std::vector<HandEyeFinding>& findings) {
  if (!record.measured_mm || hypothesis.session.mounted != Mounted::kArm) return;
  const Eigen::Vector3d off = hypothesis.fit.places.mount_from_rig.translation - *record.measured_mm;
  const double of_flange = log_density(off, kMeasuredMm), of_tool = log_density(off, kTakenMm) + std::log(kFaultShare);
  if (of_tool < of_flange + kClearly) return;
  findings.push_back({Fault::kTool, fmt::format("the scanner is {:.0f} mm from where it was measured: the poses are of "
                                                "a tool; record the flange's",
                                                off.norm())});
}

/// Names the motion that a bad verdict lacks.
void add_motion(const HandEyeResult& result, std::vector<HandEyeFinding>& findings) {
  if (grade(result.verdict) != HandEyeGrade::kBad) return;
  const Eigen::Vector3d turns = turns_by_axis(result.session.views).unaryExpr(&degrees);
  const std::string error =
      result.verdict.error_mm < 1000 ? fmt::format("is uncertain by {:.1f} mm", result.verdict.error_mm) : "is unknown";
  const std::string place = fmt::format("a point at {:.0f} mm {}", result.verdict.distance_mm, error);
  if (turns[0] > kOneTurnDegrees && turns[1] < kOneAxisShare * turns[0]) {
    findings.push_back({Fault::kOneAxis, fmt::format("the poses turn about one axis only ({:.0f}° about it, {:.1f}° "
                                                     "about others), so {}: also tilt the flange about other axes",
                                                     turns[0], turns[1], place)});
    return;
  }
  findings.push_back({Fault::kLittleMotion, fmt::format("the poses turn too little ({:.1f}°, {:.1f}° and {:.1f}° about "
                                                        "three axes), so {}: turn the flange further, and add poses",
                                                        turns[0], turns[1], turns[2], place)});
}

/// Errors that no robot has, and that no hypothesis explains.
bool is_unrelated(const HandEyeFit& fit) {
  return fit.noise.place_mm > kRobotMm || fit.noise.turn_rad > kRobotRad;
}

bool turns_too_little(const HandEyeSession& session) {
  const Eigen::Vector3d turns = turns_by_axis(session.views).unaryExpr(&degrees);
  return turns[1] < std::max(kTurnsMinDegrees, kOneAxisShare * turns[0]);
}

std::optional<HandEyeFinding> too_few(const HandEyeRecord& record) {
  std::set<std::vector<double>> poses;
  for (const RecordedView& view : record.views) poses.insert(view.pose);
  if (poses.size() >= kPosesMin) return std::nullopt;
  if (record.views.size() < kPosesMin) {
    return HandEyeFinding{
        Fault::kTooFewPoses,
        fmt::format("{} too few: at least 3 poses are needed, better 12",
                    record.views.size() == 1 ? "one pose is" : fmt::format("{} poses are", record.views.size()))};
  }
  return HandEyeFinding{Fault::kCopied, fmt::format("{} views have only {} different poses: the rest are copies",
                                                    record.views.size(), poses.size())};
}

}  // namespace

Result<HandEyeResult> diagnose_hand_eye(const HandEyeRecord& record, double working_distance_mm) {
  HandEyeResult result;
  if (auto few = too_few(record)) {
    result.findings.push_back(std::move(*few));
    return result;
  }
  auto readings = adjust_readings(record);
  if (!readings) return tl::unexpected(readings.error());
  const auto take = [&](const Hypothesis& hypothesis) {
    result.session = hypothesis.session;
    result.model = hypothesis.model;
    result.fit = hypothesis.fit;
    result.verdict = judge_hand_eye(hypothesis.fit, working_distance_mm);
  };
  const auto told = std::ranges::find_if(
      *readings, [&](const Hypothesis& each) { return differences(record, each.reading).empty(); });
  const bool is_told = told != readings->end();
  if (is_told && !is_unrelated(told->fit) && turns_too_little(told->session)) {
    take(*told);
    add_motion(result, result.findings);
    if (!result.findings.empty()) return result;
  }
  Hypothesis best = Events(record, readings->front()).find();
  if (is_told && (told == readings->begin() || is_unrelated(best.fit) || best.score < told->score + kClearly)) {
    Hypothesis of_told = told == readings->begin() ? best : Events(record, *told).find();
    if (of_told.score < told->score + kClearly) of_told = *told;
    if (best.score < of_told.score + kClearly) best = std::move(of_told);
  }
  take(best);
  result.evidence_gain = best.score - (is_told ? told->score : best.score);
  if (is_unrelated(best.fit)) {
    result.findings.push_back(
        {Fault::kUnrelated, fmt::format("the poses do not belong to these pictures: they disagree by {:.0f} mm and "
                                        "{:.1f}°; are they of another arm, or of another session?",
                                        best.fit.noise.place_mm, degrees(best.fit.noise.turn_rad))});
    return result;
  }
  result.findings = differences(record, best.reading);
  add_events(record, best, result.findings);
  add_tool(record, best, result.findings);
  if (result.findings.empty()) add_motion(result, result.findings);
  return result;
}

}  // namespace slsd
