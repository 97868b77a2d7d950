// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Symbols that hold each other, as nothing beside them stands: docs/decoder.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/decode/centres/mend_symbols.hpp"
#include "core/decode/centres/read_border.hpp"
#include "core/decode/grid/neighbourhood.hpp"

namespace slsd {
namespace {

/// Whether it is well seen, and none of an island: its letter is another, or it has none of its cells.
bool contradicts(const Sightings& seen, std::int32_t node, std::int32_t island) {
  const CellClaim& claim = seen.claims[node];
  const bool of_island = claim.named() && claim.island == island && claim.status != RegionStatus::kClassDisagrees;
  return !of_island && seen.shapes[node].is_well_seen();
}

bool is_off_grid(const Sightings& seen, std::int32_t from, std::int32_t to, Direction d, float pitch_px) {
  const GridNode& node = seen.nodes[from];
  const Eigen::Vector2f way_px = seen.nodes[to].centre_px - node.centre_px;
  return (node.frame.inverse() * way_px / pitch_px - step(d)).norm() > kOffGridSlip;
}

/// Whether it has a cell of an island, though it may lack what makes a point.
bool is_member(const CellClaim& claim) {
  return claim.named() && claim.island >= 0 &&
         (claim.status == RegionStatus::kDecoded || claim.status == RegionStatus::kDamagedShape ||
          claim.status == RegionStatus::kOffEpipolarLine || claim.status == RegionStatus::kNeighboursDisagree);
}

/// The member of the same island whose cell lies there, or -1.
std::int32_t member_beside(const Sightings& seen, std::int32_t node, Direction d) {
  const std::int32_t other = neighbour(seen.nodes, node, d);
  if (other < 0 || !is_member(seen.claims[other])) return -1;
  return seen.claims[other].island == seen.claims[node].island && seen.claims[node].fits(seen.claims[other], d) ? other
                                                                                                                : -1;
}

}  // namespace

/// Whether what links on the grid lead to, through what does not stand, may all be of a node's island: nothing there
/// contradicts, and neither it nor any of them is an end that the caller knows of. Leaves what it has come to in
/// around_.
template <class IsEnd>
bool SymbolMender::is_undisputed(const Sightings& seen, std::int32_t node, int reach, const IsEnd& is_end) {
  is_around_.resize(seen.size());
  const std::int32_t island = seen.claims[node].island;
  around_.assign(1, node);
  is_around_[node] = 1;
  const auto look_on = [&](std::int32_t from) {
    for (const Direction d : kDirections) {
      const std::int32_t other = neighbour(seen.nodes, from, d);
      if (other < 0 || is_around_[other] != 0) continue;
      const CellClaim& there = seen.claims[other];
      if (there.status == RegionStatus::kDecoded && there.island == island) continue;
      if (is_off_grid(seen, from, other, d, pitch_px_)) continue;
      if (contradicts(seen, other, island) || is_end(other)) return false;
      around_.push_back(other);
      is_around_[other] = 1;
    }
    return true;
  };
  bool undisputed = !is_end(node);
  std::size_t next = 0;
  for (int links = 0; links < reach && next < around_.size() && undisputed; ++links)
    for (const std::size_t end = around_.size(); next < end && undisputed; ++next) undisputed = look_on(around_[next]);
  for (const std::int32_t other : around_) is_around_[other] = 0;
  return undisputed;
}

/// Whether what its surroundings have refused may be looked at again: around it, as far as it could have come with
/// them, nothing on the grid contradicts.
bool SymbolMender::may_return(const Sightings& seen, std::int32_t node) {
  constexpr int kReach = 3;
  const CellClaim& claim = seen.claims[node];
  if (claim.status != RegionStatus::kNeighboursDisagree || !claim.named()) return false;
  return is_undisputed(seen, node, kReach, [](std::int32_t) { return false; });
}

/// Members of islands that may hold each other: nothing disputes what is around them, as far as nothing stands, and the
/// border of the frame, beyond which something might, is not there. Another projector's islands lie beside their lines,
/// all that is of them.
void SymbolMender::ask_groups(const Scene& scene) {
  constexpr float kAstray = 0.2F;  // of the pitch, off its line: print moves no symbol farther
  const Sightings& seen = scene.seen;
  const Eigen::Vector2f frame_px = std::visit(
      [](const auto& view) { return Eigen::Vector2f(static_cast<float>(view.width), static_cast<float>(view.height)); },
      scene.frame);
  on_line_.clear();
  for (const CellClaim& claim : seen.claims) {
    if (claim.island < 0 || claim.status == RegionStatus::kOffEpipolarLine) continue;
    on_line_.resize(std::max(on_line_.size(), static_cast<std::size_t>(claim.island) + 1));
    on_line_[claim.island] = 1;
  }
  const auto may_hold = [&](std::int32_t node) {
    const CellClaim& claim = seen.claims[node];
    return is_member(claim) && claim.status != RegionStatus::kDecoded &&
           static_cast<std::size_t>(claim.island) < on_line_.size() && on_line_[claim.island] != 0 &&
           scene.gate.off_line_px(node, claim.row, claim.column) <= kAstray * pitch_px_;
  };
  const auto is_beside_border = [&](std::int32_t node) {
    const GridNode& there = seen.nodes[node];
    return is_at_border(there.centre_px, there.frame, size_px_ + 2 * pitch_px_, frame_px);
  };
  enum : std::uint8_t { kUnknown, kUndisputed, kDisputed };
  verdicts_.assign(seen.size(), kUnknown);
  to_ask_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    if (!may_hold(node)) continue;
    const std::int32_t island = seen.claims[node].island;
    if (verdicts_[node] == kUnknown) {
      const auto is_end = [&](std::int32_t other) {
        return (seen.claims[other].island == island && verdicts_[other] == kDisputed) || is_beside_border(other);
      };
      const bool undisputed = is_undisputed(seen, node, std::numeric_limits<int>::max(), is_end);
      verdicts_[node] = undisputed ? kUndisputed : kDisputed;
      for (const std::int32_t other : around_)
        if (seen.claims[other].island == island) verdicts_[other] = verdicts_[node];
    }
    if (verdicts_[node] == kUndisputed) to_ask_.push_back(node);
  }
}

/// A symbol's square, moved across its epipolar line until it is on it.
/// @param node  that was seen near it
Eigen::Vector2f SymbolMender::onto_line(const Scene& scene, std::int32_t node, const Eigen::Vector2f& centre_px,
                                        const LatticeFrame& frame) const {
  const CellClaim& claim = scene.seen.claims[node];
  const GreyMoments& moments = scene.seen.moments[node];
  const Eigen::Vector2f way = scene.gate.way_of_line(node, claim.row, claim.column), across(-way.y(), way.x());
  const Eigen::Vector2f centroid = centre_px + frame * scene.prototypes[letter_of(claim)].centroid_px;
  const Eigen::Vector2f from_seen = frame.inverse() * (centroid - Eigen::Vector2f(moments.x, moments.y));
  const auto off_line = static_cast<float>(scene.gate.residual_px(node, claim.row, claim.column));
  return centre_px + frame * across * (off_line - across.dot(from_seen));
}

/// Where the members of its island around it have a node: a plane of the grid, through each of them where its epipolar
/// line has it, as print moves what is seen off it. What stands counts more.
SymbolMender::Place SymbolMender::place_in_group(const Scene& scene, std::int32_t node) {
  constexpr int kReach = 3;  // links
  constexpr std::size_t kFewest = 4;
  constexpr float kStanding = 4, kSpreadMin = 1e-3F, kFlattestMin = 0.01F;
  const Sightings& seen = scene.seen;
  const CellClaim& claim = seen.claims[node];
  Place place;
  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
  Eigen::Matrix<float, 3, 2> right = Eigen::Matrix<float, 3, 2>::Zero();
  const auto add = [&](std::int32_t other) {
    const CellClaim& there = seen.claims[other];
    const GridNode& at = seen.nodes[other];
    const bool stands = there.status == RegionStatus::kDecoded;
    const Eigen::Vector3f cell(1, static_cast<float>(there.column - claim.column),
                               static_cast<float>(there.row - claim.row));
    const Eigen::Vector2f centre_px = stands ? at.centre_px : onto_line(scene, other, at.centre_px, at.frame);
    const float weight = stands ? kStanding : 1;
    normal += weight * cell * cell.transpose();
    right += weight * cell * centre_px.transpose();
  };
  is_around_.resize(seen.size());
  around_.assign(1, node);
  is_around_[node] = 1;
  std::size_t next = 0;
  for (int links = 0; links < kReach; ++links) {
    for (const std::size_t end = around_.size(); next < end; ++next) {
      const std::int32_t from = around_[next];
      for (const Direction d : kDirections) {
        const std::int32_t other = member_beside(seen, from, d);
        if (other < 0) continue;
        if (from == node) {
          const GreyMoments& light = seen.moments[other];
          place.background += light.background, place.peak += light.peak, ++place.held_by;
        }
        if (is_around_[other] != 0) continue;
        add(other);
        around_.push_back(other);
        is_around_[other] = 1;
      }
    }
  }
  for (const std::int32_t other : around_) is_around_[other] = 0;
  const bool spread = normal.determinant() > kSpreadMin * normal.diagonal().prod();
  if (around_.size() <= kFewest || place.held_by < kHeldBy || !spread) return {};
  const auto held_by = static_cast<float>(place.held_by);
  place.background /= held_by, place.peak /= held_by;
  const Eigen::Matrix<float, 3, 2> plane = normal.ldlt().solve(right);
  place.frame = plane.bottomRows<2>().transpose() / pitch_px_;
  if (!(std::abs(place.frame.determinant()) > kFlattestMin * place.frame.squaredNorm())) return {};
  place.centre_px = onto_line(scene, node, plane.row(0).transpose(), place.frame);
  return place;
}

/// Whether its letter is seen where the others have it, tilted as they are. What print darkens does not count: but what
/// is seen in its middle may be nothing else.
bool SymbolMender::agrees_in_group(const Scene& scene, std::size_t asked) const {
  constexpr float kAcrossMaxPx = 0.3F;  // projector px
  constexpr float kMovedMax = 0.04F;    // of the pitch
  constexpr float kMiddleMin = 0.67F, kSupportMin = 0.75F;
  const PatchTask& task = tasks_[asked];
  const Place& place = places_[asked];
  if (task.failed || std::abs(task.moved) > kSettledPx || std::abs(task.state.across) > kAcrossMaxPx) return false;
  if (std::abs(task.state.disparity) > kMovedMax * pitch_px_ || !(tilt_px(task, place) <= kTiltMaxPx)) return false;
  const Eigen::Vector2f centre = centre_of(task, letter_of(scene.seen.claims[asked_[asked]]));
  const Shares middle = shares_of_square(scene.frame, scene.field, task, centre, kMiddleReachPx);
  if (middle.agree + middle.darkened < kMiddleMin) return false;
  return task.support >= kSupportMin || support_beside_print(scene, task, place.frame) >= kSupportMin;
}

/// Of the tasks that agree leaves out those that had been refused where too many of their row or column show light that
/// their letters do not have there: print takes light and gives none, but two letters do, that an edge along the line
/// has parted. Those whose halves are of one letter are whole there, too.
void SymbolMender::refuse_torn_lines(const Scene& scene) {
  constexpr int kFar = 8;
  constexpr int kAgreeingToOne = 3;
  constexpr float kOtherLight = 0.1F;  // of a cell
  const Sightings& seen = scene.seen;
  enum Vote : std::uint8_t { kUnknown, kAgrees, kAgainst, kNone };
  votes_.assign(tasks_.size(), kUnknown);
  for (const std::size_t i : agreeing_) votes_[i] = kAgrees;
  task_of_.assign(seen.size(), -1);
  for (std::size_t i = 0; i < asked_.size(); ++i) task_of_[asked_[i]] = static_cast<std::int32_t>(i);
  // What is misread, or was not asked, speaks against its line, too; what cannot be aligned says nothing.
  const auto vote_of = [&](std::int32_t node) -> std::uint8_t {
    if (seen.claims[node].status == RegionStatus::kDecoded) return kAgrees;
    if (task_of_[node] < 0) return kAgainst;
    const PatchTask& task = tasks_[task_of_[node]];
    std::uint8_t& vote = votes_[task_of_[node]];
    if (vote != kUnknown) return vote;
    const LatticeFrame& frame = places_[task_of_[node]].frame;
    const bool against = !task.failed && shares_of_cell(scene, task, frame).brighter_there >= kOtherLight;
    return vote = against ? kAgainst : kNone;
  };
  const auto is_on_torn_line = [&](std::size_t i) {
    const std::int32_t node = asked_[i];
    if (seen.claims[node].status != RegionStatus::kNeighboursDisagree) return false;
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      int agreeing = 0, against = 0;
      for (const Direction d : {forth, opposite(forth)}) {
        std::int32_t other = seen.nodes[node].links[d];
        for (int link = 0; link < kFar && other >= 0; ++link, other = seen.nodes[other].links[d]) {
          const CellClaim& claim = seen.claims[other];
          if (!claim.named() || claim.island != seen.claims[node].island) continue;
          const std::uint8_t vote = vote_of(other);
          agreeing += vote == kAgrees, against += vote == kAgainst;
        }
      }
      return agreeing < kAgreeingToOne * against;
    });
  };
  std::erase_if(agreeing_, is_on_torn_line);
}

/// Of the tasks that agree those that are three or more beside each other: one or two may be of another surface.
void SymbolMender::keep_groups(const Sightings& seen) {
  constexpr std::size_t kFewest = 3;
  is_around_.resize(seen.size());
  for (const std::size_t i : agreeing_) is_around_[asked_[i]] = 1;
  grouped_.clear();
  for (const std::size_t i : agreeing_) {
    if (is_around_[asked_[i]] == 0) continue;
    around_.assign(1, asked_[i]);
    is_around_[asked_[i]] = 0;
    for (std::size_t next = 0; next < around_.size(); ++next) {
      for (const Direction d : kDirections) {
        const std::int32_t other = member_beside(seen, around_[next], d);
        if (other < 0 || is_around_[other] == 0) continue;
        around_.push_back(other);
        is_around_[other] = 0;
      }
    }
    if (around_.size() >= kFewest) grouped_.insert(grouped_.end(), around_.begin(), around_.end());
  }
  std::ranges::sort(grouped_);
  std::erase_if(agreeing_, [&](std::size_t i) { return !std::ranges::binary_search(grouped_, asked_[i]); });
}

/// What nothing beside it that stands could hold, as print, shade or an edge has spoilt all that is around it.
void SymbolMender::mend_groups(const Scene& scene) {
  ask_groups(scene);
  asked_.clear(), places_.clear(), tasks_.clear();
  for (const std::int32_t node : to_ask_)
    if (const Place place = place_in_group(scene, node); place.held_by > 0) set_up(scene, place, node);
  align(scene.frame, scene.full, scene.field);
  agreeing_.clear();
  for (std::size_t i = 0; i < asked_.size(); ++i)
    if (agrees_in_group(scene, i)) agreeing_.push_back(i);
  refuse_torn_lines(scene);
  keep_groups(scene.seen);
  for (const std::size_t i : agreeing_) {
    take_over(tasks_[i], places_[i].frame, scene.prototypes, scene.seen, asked_[i]);
    mended_.push_back(asked_[i]);
  }
}

}  // namespace slsd
