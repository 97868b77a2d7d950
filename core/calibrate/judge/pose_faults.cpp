// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/judge/pose_faults.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/calibrate/judge/lit_surface.hpp"
#include "core/calibrate/judge/view_demands.hpp"
#include "core/calibrate/solve/point_residuals.hpp"
#include "core/calibrate/solve/start/corner_pose.hpp"
#include "core/geometry/robust.hpp"

namespace slsd {
namespace {

/// Ratio to the other poses' error above which chance does not explain an error.
constexpr double kContradiction = 2.5;
constexpr double kContradictionMinPx = 0.1;
/// The same in standard deviations of what the poses say about the rig. Consistent poses have about 1. A board that
/// turned by 0.1 degrees before the pattern came has 4, and moves the principal point by 3 px.
constexpr double kDisagreementMin = 3;
/// Share of outlying points of a pose: above it the pose is wrong, rather than single points.
constexpr double kOutlyingShare = 0.15, kUsualOutlyingShare = 0.05;
/// Ratio to the other poses' bend or shift above which it explains an error.
constexpr double kExplains = 3;
constexpr double kBowShareMin = 0.4;
/// Corners on a bent board give a plane that is off by about the bend; a board that moved without a bend shows none.
constexpr double kBowOfShiftMin = 0.3;
/// Symbols scatter if the pattern was divided by a displaced print; the smaller the move, the less they scatter.
constexpr double kUnevenOfShiftMin = 0.3;
/// Largest root mean square distance from a plane that a board can have, as a share of half the board's size.
constexpr double kUnevenShareMax = 0.1;
/// Displacement of the print under the pattern above which the board's picture says nothing about the pattern's
/// picture.
constexpr double kShiftMaxPx = 1;
/// Symbols lie off the board as if it had moved this far in the camera, but its print did not move: then the board is
/// not the cause.
constexpr double kShownByPrintPx = 5;
/// Corners this near to those of an earlier pose, as a share of the image's width, add no information.
constexpr double kSamePlaceShare = 0.005;
/// Share of a pose's symbols with an object before them; above the second limit, the board moved.
constexpr double kCoveredShare = 0.08, kUncoveredShare = 0.5;
/// Ratio to the usual error above which the figure has no meaning.
constexpr double kErrorRatioShownMax = 100;
/// Share of outlying points above which no other fault needs to be reported.
constexpr double kHardlyAnyShare = 0.9;
constexpr char kHardlyAny[] = "almost no point of it agrees with them";

/// The blurriest view of a pose.
double blur_of(const PoseObservation& pose) {
  double blur = 0;
  for (const PoseView& view : pose.views) blur = std::max(blur, view.blur_px);
  return blur;
}

double usual_blur_of(PoseSubject subject, const Observations& observations) {
  std::vector<double> blurs;
  for (const PoseObservation& pose : observations.poses) {
    if (pose.subject == subject && blur_of(pose) > 0) blurs.push_back(blur_of(pose));
  }
  return median_of(std::move(blurs));
}

/// Describes the missing corners in the view with the most corners, if all views lack some.
std::string least_lack_of_corners(const PoseObservation& pose) {
  std::string lack = "the board was not found";
  std::size_t most = 0;
  for (const PoseView& view : pose.views) {
    std::string of_view = lack_of_corners(view);
    if (of_view.empty()) return {};
    if (view.corners.size() >= most) most = view.corners.size(), lack = std::move(of_view);
  }
  return lack;
}

/// Describes the missing symbols among views with enough corners.
std::string least_lack_of_symbols(const PoseObservation& pose) {
  std::size_t most = 0;
  for (const PoseView& view : pose.views) {
    if (lack_of_corners(view).empty()) most = std::max(most, view.symbols.size());
  }
  return lack_of_symbols(most);
}

double clipped_share_of(const PoseObservation& pose) {
  double share = 0;
  for (const PoseView& view : pose.views) share = std::max(share, view.clipped_share);
  return share;
}

double shift_of(const PoseObservation& pose) {
  double shift = 0;
  for (const PoseView& view : pose.views) shift = std::max(shift, view.shift_px ? view.shift_px->norm() : 0);
  return shift;
}

/// Root mean square distance between the corners that both views share; empty if they share hardly any.
std::optional<double> apart_px(const PoseView& one, const PoseView& other) {
  constexpr std::size_t kCommonMin = 4;
  std::map<std::pair<double, double>, Eigen::Vector2d> places;
  for (const BoardPoint& corner : one.corners) places[{corner.board_mm.x(), corner.board_mm.y()}] = corner.camera_px;
  double sum = 0;
  std::size_t count = 0;
  for (const BoardPoint& corner : other.corners) {
    const auto place = places.find({corner.board_mm.x(), corner.board_mm.y()});
    if (place != places.end()) sum += (place->second - corner.camera_px).squaredNorm(), ++count;
  }
  if (count < kCommonMin) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

/// Tells whether all views of the later pose show the board at the earlier one's place.
bool repeats(const PoseObservation& earlier, const PoseObservation& later, const Observations& observations) {
  if (earlier.subject != later.subject) return false;
  bool any = false;
  for (const PoseView& view : later.views) {
    const auto before = std::ranges::find(earlier.views, view.camera, &PoseView::camera);
    if (before == earlier.views.end()) return false;
    const auto apart = apart_px(*before, view);
    const double width_px = observations.cameras[view.camera].size.width_px;
    if (!apart || *apart > kSamePlaceShare * width_px) return false;
    any = true;
  }
  return any;
}

/// Share of outlying points among the corners or the symbols of a pose, whichever is larger.
double outlying_share(const PoseObservation& pose) {
  double corners = 0, outlying_corners = 0, symbols = 0, outlying_symbols = 0;
  for (const PoseView& view : pose.views) {
    for (const BoardPoint& corner : view.corners) corners += 1, outlying_corners += corner.outlying ? 1 : 0;
    for (const ProjectedPoint& symbol : view.symbols) symbols += 1, outlying_symbols += symbol.outlying ? 1 : 0;
  }
  return std::max(outlying_corners / std::max(corners, 1.0), outlying_symbols / std::max(symbols, 1.0));
}

/// Median over the poses of the same subject.
double usual(const std::vector<double>& values, PoseSubject subject, const Observations& observations) {
  std::vector<double> same;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (observations.poses[i].subject == subject) same.push_back(values[i]);
  }
  return median_of(std::move(same));
}

/// The surface of the symbols relative to the plane through the corners alone: the rig's own estimate depends on both.
LitSurface surface_of(std::size_t pose, const Observations& observations, const RigModel& rig) {
  const MotionVector& joint = rig.rig_from_board[pose];
  const auto by_corners = pose_by_corners(observations.poses[pose], rig, joint);
  return measure_lit_surface(observations.poses[pose], rig, by_corners.value_or(joint));
}

/// Shift of the print under the pattern that a move of the board along its normal would cause. It is that of the view
/// that would show it most, among views whose print did not move; root mean square over the corners.
double unshown_px(const PoseObservation& pose, const RigModel& rig, const MotionVector& place, double along_normal_mm) {
  double most = 0;
  for (const PoseView& view : pose.views) {
    if (!view.shift_px) continue;
    const DeviceModel& device = rig.cameras[view.camera];
    const RigidTransform camera_from_board = to_motion(device.device_from_rig).after(to_motion(place));
    const Lens lens = to_lens(device.lens, device.size);
    std::vector<Eigen::Vector2d> moved;
    for (const BoardPoint& corner : view.corners) {
      const Eigen::Vector3d before(corner.board_mm.x(), corner.board_mm.y(), 0),
          after(corner.board_mm.x(), corner.board_mm.y(), along_normal_mm);
      moved.push_back(lens.project(camera_from_board * after) - lens.project(camera_from_board * before));
    }
    most = std::max(most, rms_px(moved));
  }
  return most;
}

/// Surfaces of a pose, and how they compare with those of the others.
struct Explanation {
  LitSurface surface;
  double shift_mm = 0;
  double bow_factor = 0, shift_factor = 0, flatness_factor = 0;
  double believable_mm = 0;  ///< limit above which it is no board

  /// Tells whether the board has a second-order bend, like a print on cardboard.
  [[nodiscard]] bool is_bowed() const {
    return surface.bow_share > kBowShareMin && bow_factor > kExplains && surface.bow_mm > kBowOfShiftMin * shift_mm &&
           surface.bow_mm < believable_mm;
  }
  /// Tells whether the symbols lie on no plane, beyond the error that a displaced print causes.
  [[nodiscard]] bool is_uneven() const {
    return flatness_factor > kExplains && surface.flatness_mm < kUnevenShareMax * believable_mm &&
           surface.flatness_mm > kUnevenOfShiftMin * shift_mm;
  }
  /// Tells whether the symbols lie on a plane other than that of the corners.
  [[nodiscard]] bool is_moved() const { return shift_factor > kExplains && !is_uneven() && shift_mm < believable_mm; }
};

Explanation compare(std::size_t pose, const Observations& observations, const RigModel& rig) {
  std::vector<LitSurface> surfaces;
  std::vector<double> bows, shifts, flatnesses;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    surfaces.push_back(surface_of(i, observations, rig));
    bows.push_back(surfaces.back().bow_mm);
    shifts.push_back(surfaces.back().shift_mm(half_size_mm(observations.poses[i])));
    flatnesses.push_back(surfaces.back().flatness_mm);
  }
  const auto factor = [pose](const std::vector<double>& values) {
    return values[pose] / std::max(median_of(values), 1e-6);
  };
  return {surfaces[pose], shifts[pose],       factor(bows),
          factor(shifts), factor(flatnesses), half_size_mm(observations.poses[pose])};
}

/// @param error  the reason if nothing explains the fault
FaultyPose explain(std::size_t pose, const std::string& error, const Observations& observations, const RigModel& rig) {
  const Explanation shown = compare(pose, observations, rig);
  const char* const subject = observations.poses[pose].subject == PoseSubject::kBoard ? "board" : "plane";
  const auto& surface = shown.surface;
  if (surface.before_share > kCoveredShare && surface.before_share < kUncoveredShare) {
    return {pose, PoseFault::kCovered,
            fmt::format("something covered the {}: {:.0f} % of the symbols lie about {:.0f} mm in front of it; keep "
                        "hands and cables out of its light",
                        subject, 100 * surface.before_share, surface.before_mm)};
  }
  if (unshown_px(observations.poses[pose], rig, rig.rig_from_board[pose], surface.offset_mm) > kShownByPrintPx) {
    return {pose, PoseFault::kUnlike,
            fmt::format("its symbols lie {:.0f} mm off the {}, although its print did not move between the pictures: "
                        "the camera or the projector moved since the other poses; fasten both, and take it again",
                        std::abs(surface.offset_mm), subject)};
  }
  if (shown.is_bowed()) {
    return {pose, PoseFault::kBent,
            fmt::format("the {} is not flat: it is bent by {:.1f} mm, {:.0f} times as much as in the other poses; "
                        "mount the print on a stiff plate",
                        subject, shown.surface.bow_mm, shown.bow_factor)};
  }
  if (shown.is_uneven()) {
    return {pose, PoseFault::kBent,
            fmt::format("the {} is not flat: its symbols are {:.1f} mm off any plane, {:.0f} times as much as in the "
                        "other poses; mount the print on a stiff plate, and hold it still",
                        subject, shown.surface.flatness_mm, shown.flatness_factor)};
  }
  if (shown.is_moved()) {
    return {pose, PoseFault::kMoved,
            fmt::format("the {} moved by {:.1f} mm and {:.2f} degrees between the white picture and the pattern; hold "
                        "it still, or lean it against something",
                        subject, std::abs(shown.surface.offset_mm), shown.surface.tilt_deg)};
  }
  return {pose, PoseFault::kUnlike, fmt::format("it contradicts the other poses: {}; take it again", error)};
}

}  // namespace

std::string_view to_string(PoseFault fault) {
  switch (fault) {
    case PoseFault::kNotSeen:
      return "not_seen";
    case PoseFault::kTooFewCorners:
      return "too_few_corners";
    case PoseFault::kTooFewSymbols:
      return "too_few_symbols";
    case PoseFault::kBlurred:
      return "blurred";
    case PoseFault::kClipped:
      return "clipped";
    case PoseFault::kRepeated:
      return "repeated";
    case PoseFault::kSwapped:
      return "swapped";
    case PoseFault::kCovered:
      return "covered";
    case PoseFault::kBent:
      return "bent";
    case PoseFault::kMoved:
      return "moved";
    case PoseFault::kUnlike:
      break;
  }
  return "unlike_the_others";
}

std::vector<FaultyPose> find_unusable(const Observations& observations) {
  std::vector<FaultyPose> faulty;
  for (std::size_t i = 0; i < observations.poses.size(); ++i) {
    const PoseObservation& pose = observations.poses[i];
    std::string corners = least_lack_of_corners(pose), symbols = least_lack_of_symbols(pose),
                light = excess_of_light(clipped_share_of(pose));
    const auto is_fine = [&](std::size_t other) {
      return std::ranges::none_of(faulty, [&](const FaultyPose& one) { return one.pose == other; });
    };
    std::size_t same = 0;
    while (same < i && !(is_fine(same) && repeats(observations.poses[same], pose, observations))) ++same;
    const double blur = blur_of(pose), usual_blur = usual_blur_of(pose.subject, observations);
    if (!light.empty()) {
      faulty.push_back({i, PoseFault::kClipped, std::move(light)});
    } else if (!corners.empty()) {
      faulty.push_back({i, PoseFault::kTooFewCorners, std::move(corners)});
    } else if (!symbols.empty()) {
      faulty.push_back({i, PoseFault::kTooFewSymbols, std::move(symbols)});
    } else if (is_blurred(blur, usual_blur)) {
      faulty.push_back({i, PoseFault::kBlurred,
                        fmt::format("blurred: the board's edges are {:.1f} px wide, {:.1f} px in the other poses; hold "
                                    "it still, and within the depth of focus",
                                    blur, usual_blur)});
    } else if (shift_of(pose) > kShiftMaxPx) {
      faulty.push_back({i, PoseFault::kMoved,
                        fmt::format("the board's print moved by {:.0f} px between the white picture and the pattern; "
                                    "hold it still, or lean it against something",
                                    shift_of(pose))});
    } else if (same < i) {
      faulty.push_back({i, PoseFault::kRepeated,
                        fmt::format("it shows the board in the same place as {}, so both count once; move, tilt or "
                                    "turn the board between poses",
                                    observations.poses[same].name)});
    }
  }
  return faulty;
}

std::optional<FaultyPose> find_unplaced(const Observations& observations, const RigModel& rig,
                                        const PoseInfluence& influence) {
  const auto at = std::ranges::find(influence.held_out, false, &HeldOut::placed);
  if (at == influence.held_out.end()) return std::nullopt;
  return explain(static_cast<std::size_t>(at - influence.held_out.begin()), kHardlyAny, observations, rig);
}

std::optional<FaultyPose> find_contradiction(const Observations& observations, const RigModel& rig,
                                             const PoseInfluence& influence) {
  if (auto unplaced = find_unplaced(observations, rig, influence)) return unplaced;
  std::vector<double> corner, symbol, shares, disagreement;
  for (const PoseObservation& pose : observations.poses) shares.push_back(outlying_share(pose));
  for (const HeldOut& held_out : influence.held_out) {
    corner.push_back(held_out.corner_rms_px), symbol.push_back(held_out.symbol_rms_px);
    disagreement.push_back(held_out.disagreement);
  }
  const double usual_disagreement = std::max(median_of(disagreement), 1.0);
  // Corners of the board and of the plane are found with different accuracy.
  const std::map<PoseSubject, double> usual_corner{
      {PoseSubject::kBoard, usual(corner, PoseSubject::kBoard, observations)},
      {PoseSubject::kPlane, usual(corner, PoseSubject::kPlane, observations)}};
  const double usual_symbol = median_of(symbol), usual_share = median_of(shares);
  std::size_t worst = 0;
  double times = 0;
  for (std::size_t i = 0; i < influence.held_out.size(); ++i) {
    const double by_corner =
        corner[i] > kContradictionMinPx ? corner[i] / usual_corner.at(observations.poses[i].subject) : 0;
    const double by_symbol = symbol[i] > kContradictionMinPx ? symbol[i] / usual_symbol : 0;
    const double by_share = shares[i] > kOutlyingShare ? shares[i] / std::max(usual_share, kUsualOutlyingShare) : 0;
    const double by_rig = disagreement[i] > kDisagreementMin ? disagreement[i] / usual_disagreement : 0;
    const double most = std::max({by_corner, by_symbol, by_share, by_rig});
    if (most > times) times = most, worst = i;
  }
  if (times < kContradiction) return std::nullopt;
  if (shares[worst] > kHardlyAnyShare) return explain(worst, kHardlyAny, observations, rig);
  return explain(worst,
                 times < kErrorRatioShownMax
                     ? fmt::format("its error is {:.1f} times theirs", times)
                     : fmt::format("its error is more than {:.0f} times theirs", kErrorRatioShownMax),
                 observations, rig);
}

}  // namespace slsd
