// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/centres/mend_groups.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "core/decode/centres/read_border.hpp"

namespace slsd {
namespace {

constexpr int kFewestBeside = 3;  // hold each other: one or two may be of another surface

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

/// The member whose cell lies beside a node's as it does, or -1.
std::int32_t member_beside(const Sightings& seen, std::int32_t node, Direction d) {
  const std::int32_t other = neighbour(seen.nodes, node, d);
  return other >= 0 && is_member(seen.claims[other]) && seen.claims[node].fits(seen.claims[other], d) ? other : -1;
}

/// Of a node that one member holds: whether links lead on along the line across, and to nothing there that has a cell.
/// All of that line may be of another surface, and this one of its letters be the right one by chance.
bool is_alone_on_line(const Sightings& seen, std::int32_t node) {
  const Direction held_from =
      *std::ranges::find_if(kDirections, [&](Direction d) { return member_beside(seen, node, d) >= 0; });
  bool linked = false;
  for (const int side : {0, 1}) {
    const std::int32_t other = seen.nodes[node].links[across(held_from, side)];
    if (other >= 0 && seen.claims[other].named()) return false;
    linked |= other >= 0;
  }
  return linked;
}

/// A symbol's square, moved across its epipolar line until it is on it.
/// @param node  that was seen near it
Eigen::Vector2f onto_line(const LetterScene& scene, std::int32_t node, int letter, const Eigen::Vector2f& centre_px,
                          const LatticeFrame& frame) {
  const CellClaim& claim = scene.seen.claims[node];
  const GreyMoments& moments = scene.seen.moments[node];
  const Eigen::Vector2f way = scene.gate.way_of_line(node, claim.row, claim.column), across(-way.y(), way.x());
  const Eigen::Vector2f centroid = centre_px + frame * scene.prototypes[letter].centroid_px;
  const Eigen::Vector2f from_seen = frame.inverse() * (centroid - Eigen::Vector2f(moments.x, moments.y));
  const auto off_line = static_cast<float>(scene.gate.residual_px(node, claim.row, claim.column));
  return centre_px + frame * across * (off_line - across.dot(from_seen));
}

}  // namespace

bool has_settled(const Rules& rules, CellClaim& claim, const PatchTask& task) {
  if (task.failed) claim.guard = DecodeRule::kMendUnsettled;
  return !task.failed && claim.pass(rules, DecodeRule::kMendUnsettled, !(std::abs(task.moved) > kAlignedSettledPx));
}

Disputes::Disputes(const Pattern& pattern) : array_(pattern.array), pitch_px_(static_cast<float>(pattern.pitch_px())) {}

template <class IsEnd>
bool Disputes::none_around(const Sightings& seen, std::int32_t node, int reach, const IsEnd& is_end) {
  const CellClaim& claim = seen.claims[node];
  bool undisputed = !is_end(node, true);
  of_surface_.assign(1, node);
  const auto look = [&](const LinkWalk::Stop& from, const LinkWalk::Stop& to, Direction d) {
    const CellClaim& there = seen.claims[to.node];
    const int row = claim.row + to.rows, column = claim.column + to.columns;
    const bool has_cell = there.same_cell(row, column);
    const bool stands = there.status == RegionStatus::kDecoded && there.island == claim.island;
    if (stands && has_cell) return LinkWalk::Go::kPast;
    if (is_off_grid(seen, from.node, to.node, d, pitch_px_)) return LinkWalk::Go::kPast;
    const Classification& shape = seen.shapes[to.node];
    const bool on_array = row >= 0 && column >= 0 && row < array_.rows && column < array_.columns;
    const bool agrees = (has_cell || !there.named()) && on_array && shape.letter == array_.at(row, column);
    undisputed = (agrees || !shape.is_well_seen()) && !is_end(to.node, has_cell);
    if (!undisputed) return LinkWalk::Go::kNoFarther;
    if (has_cell) of_surface_.push_back(to.node);
    return LinkWalk::Go::kOn;
  };
  walk_.walk(seen.nodes, node, undisputed ? reach : 0, look);
  return undisputed;
}

bool Disputes::none_around(const Sightings& seen, std::int32_t node, int reach) {
  return none_around(seen, node, reach, [](std::int32_t, bool) { return false; });
}

GroupMender::GroupMender(const Pattern& pattern, std::shared_ptr<const LetterFields> letters, Rules rules)
    : pitch_px_(static_cast<float>(pattern.pitch_px())),
      size_px_(static_cast<float>(pattern.options.symbol_size_px)),
      rules_(rules),
      aligner_(pattern, std::move(letters)),
      disputes_(pattern) {}

/// Those that may hold each other: nothing disputes what is around them, as far as nothing stands, and the border of
/// the frame, beyond which something might, is not there. Another projector's islands lie beside their lines, all that
/// is of them.
void GroupMender::find_members(const LetterScene& scene) {
  constexpr float kAstray = 0.2F;  // of the pitch, off its line: print moves no symbol farther
  const Sightings& seen = scene.seen;
  const auto [width, height] = size_of(scene.frame);
  const Eigen::Vector2f frame_px(static_cast<float>(width), static_cast<float>(height));
  is_on_line_.clear();
  for (const CellClaim& claim : seen.claims) {
    if (claim.island < 0 || claim.status == RegionStatus::kOffEpipolarLine) continue;
    is_on_line_.resize(std::max(is_on_line_.size(), static_cast<std::size_t>(claim.island) + 1));
    is_on_line_[claim.island] = 1;
  }
  const auto may_hold = [&](std::int32_t node) {
    const CellClaim& claim = seen.claims[node];
    return is_member(claim) && claim.status != RegionStatus::kDecoded &&
           static_cast<std::size_t>(claim.island) < is_on_line_.size() && is_on_line_[claim.island] != 0 &&
           scene.gate.off_line_px(node, claim.row, claim.column) <= kAstray * pitch_px_;
  };
  enum : std::uint8_t { kUnknown, kUndisputed, kDisputed };
  verdicts_.assign(seen.size(), kUnknown);
  to_ask_.clear();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto node = static_cast<std::int32_t>(i);
    if (!may_hold(node)) continue;
    if (verdicts_[node] == kUnknown) {
      const auto is_end = [&](std::int32_t other, bool has_cell) {
        const GridNode& there = seen.nodes[other];
        return (has_cell && verdicts_[other] == kDisputed) ||
               is_at_border(there.centre_px, there.frame, size_px_ + 2 * pitch_px_, frame_px);
      };
      const bool undisputed = disputes_.none_around(seen, node, std::numeric_limits<int>::max(), is_end);
      for (const std::int32_t other : disputes_.of_surface()) verdicts_[other] = undisputed ? kUndisputed : kDisputed;
    }
    const bool undisputed = verdicts_[node] == kUndisputed;
    if (scene.seen.claims[node].pass(rules_, DecodeRule::kGroupDisputed, undisputed)) to_ask_.push_back(node);
  }
}

/// Where the members around it have a node: a plane of the grid, through each of them where its epipolar line has it,
/// as print moves what is seen off it. What stands counts more.
LetterPlace GroupMender::place_of(const LetterScene& scene, std::int32_t node) {
  constexpr int kReach = 3;  // links
  constexpr std::size_t kFewest = 4;
  constexpr float kStanding = 4, kFlattestMin = 0.01F;
  const Sightings& seen = scene.seen;
  LetterPlace place;
  for (const Direction d : kDirections) {
    const std::int32_t beside = member_beside(seen, node, d);
    if (beside < 0) continue;
    const GreyMoments& light = seen.moments[beside];
    place.background += light.background, place.peak += light.peak, ++place.held_by;
  }
  if (place.held_by == 0) return {};
  const auto held_by = static_cast<float>(place.held_by);
  place.background /= held_by, place.peak /= held_by;
  const std::vector<LinkWalk::Stop>& around =
      walk_.walk(seen.nodes, node, kReach, [&](const LinkWalk::Stop& from, const LinkWalk::Stop&, Direction d) {
        return member_beside(seen, from.node, d) < 0 ? LinkWalk::Go::kPast : LinkWalk::Go::kOn;
      });
  if (around.size() <= kFewest) return {};
  Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
  Eigen::Matrix<float, 3, 2> right = Eigen::Matrix<float, 3, 2>::Zero();
  for (std::size_t i = 1; i < around.size(); ++i) {
    const auto& [other, rows, columns] = around[i];
    const CellClaim& claim = seen.claims[other];
    const GridNode& at = seen.nodes[other];
    const bool stands = claim.status == RegionStatus::kDecoded;
    const Eigen::Vector3f cell(1, static_cast<float>(columns), static_cast<float>(rows));
    const Eigen::Vector2f centre_px =
        stands ? at.centre_px : onto_line(scene, other, aligner_.letter_of(claim), at.centre_px, at.frame);
    const float weight = stands ? kStanding : 1;
    normal += weight * cell * cell.transpose();
    right += weight * cell * centre_px.transpose();
  }
  const Eigen::Matrix<float, 3, 2> plane = normal.ldlt().solve(right);  // flat where all are in a row
  place.frame = plane.bottomRows<2>().transpose() / pitch_px_;
  if (!(std::abs(place.frame.determinant()) > kFlattestMin * place.frame.squaredNorm())) return {};
  place.centre_px =
      onto_line(scene, node, aligner_.letter_of(seen.claims[node]), plane.row(0).transpose(), place.frame);
  return place;
}

/// Whether its letter is seen where the others have it, tilted as they are. What print darkens does not count: but what
/// is seen in its middle may be nothing else. With one beside it, it may lie beyond the edge of their surface; what had
/// been refused for its surroundings is not alone on its line then.
bool GroupMender::shows_letter(const LetterScene& scene, const AskedLetter& asked) const {
  constexpr float kMovedMax = 0.06F;  // of the pitch
  constexpr float kMiddleMin = 0.6F, kSupportMin = 0.75F;
  const PatchTask& task = asked.task;
  CellClaim& claim = scene.seen.claims[asked.node];
  if (!has_settled(rules_, claim, task)) return false;
  const bool lone = asked.place.held_by == 1;
  const bool line_alone =
      lone && claim.status == RegionStatus::kNeighboursDisagree && is_alone_on_line(scene.seen, asked.node);
  if (!claim.pass(rules_, DecodeRule::kGroupLineAlone, !line_alone)) return false;
  const bool in_place = std::abs(task.state.across) <= (lone ? kLoneAcrossMaxPx : kAlignedAcrossMaxPx) &&
                        std::abs(task.state.disparity) <= kMovedMax * pitch_px_ && asked.tilt_px <= kAlignedTiltMaxPx;
  if (!claim.pass(rules_, DecodeRule::kGroupMisplaced, in_place)) return false;
  const auto agrees = [&] {
    const LightShares middle = aligner_.shares_of_middle(scene, asked);
    if (middle.agree + middle.darkened < kMiddleMin) return false;
    const float support_min = lone ? kLoneSupportMin : kSupportMin;
    return task.support >= support_min || aligner_.support_beside_print(scene, asked) >= support_min;
  };
  return claim.pass(rules_, DecodeRule::kGroupUnlike, agrees());
}

/// Of those that agree leaves out those that had been refused where too many of their row or column show light that
/// their letters do not have there: print takes light and gives none, but two letters do, that an edge along the line
/// has parted. Those whose halves are of one letter are whole there, too.
void GroupMender::refuse_torn_lines(const LetterScene& scene) {
  constexpr int kFar = 8;
  constexpr int kAgreeingToOne = 2;
  const Sightings& seen = scene.seen;
  enum class Vote : std::uint8_t { kAgrees, kAgainst, kNone };
  // What is misread, or was not asked, speaks against its line, too; what cannot be aligned says nothing.
  const auto vote_of = [&](std::int32_t node) {
    if (seen.claims[node].status == RegionStatus::kDecoded) return Vote::kAgrees;
    if (asked_of_[node] < 0) return Vote::kAgainst;
    Member& member = known_[asked_of_[node]];
    if (member.shows_letter) return Vote::kAgrees;
    if (!member.shows_other_light) member.shows_other_light = aligner_.shows_other_light(scene, member.letter);
    return *member.shows_other_light ? Vote::kAgainst : Vote::kNone;
  };
  const auto is_on_torn_line = [&](std::int32_t i) {
    const std::int32_t node = known_[i].letter.node;
    if (seen.claims[node].status != RegionStatus::kNeighboursDisagree) return false;
    return std::ranges::any_of(std::array{kRight, kDown}, [&](Direction forth) {
      int agreeing = 0, against = 0;
      for (const Direction d : {forth, opposite(forth)}) {
        std::int32_t other = seen.nodes[node].links[d];
        for (int link = 0; link < kFar && other >= 0; ++link, other = seen.nodes[other].links[d]) {
          const CellClaim& claim = seen.claims[other];
          if (!claim.named() || claim.island != seen.claims[node].island) continue;
          const Vote vote = vote_of(other);
          agreeing += vote == Vote::kAgrees, against += vote == Vote::kAgainst;
        }
      }
      return agreeing < kAgreeingToOne * against;
    });
  };
  std::erase_if(agreeing_, [&](std::int32_t i) {
    return !scene.seen.claims[known_[i].letter.node].pass(rules_, DecodeRule::kGroupTornLine, !is_on_torn_line(i));
  });
}

/// Of those that agree those that are enough beside each other.
void GroupMender::keep_groups(Sightings& seen) {
  enum : std::uint8_t { kNo, kAgrees, kInGroup };
  agrees_.assign(seen.size(), kNo);
  const auto node_of = [&](std::int32_t i) { return known_[i].letter.node; };
  for (const std::int32_t i : agreeing_) agrees_[node_of(i)] = kAgrees;
  for (const std::int32_t i : agreeing_) {
    if (agrees_[node_of(i)] != kAgrees) continue;
    const auto look = [&](const LinkWalk::Stop& from, const LinkWalk::Stop& to, Direction d) {
      return agrees_[to.node] != kNo && member_beside(seen, from.node, d) >= 0 ? LinkWalk::Go::kOn
                                                                               : LinkWalk::Go::kPast;
    };
    const std::vector<LinkWalk::Stop>& group =
        walk_.walk(seen.nodes, node_of(i), std::numeric_limits<int>::max(), look);
    for (const LinkWalk::Stop& stop : group) agrees_[stop.node] = group.size() >= kFewestBeside ? kInGroup : kNo;
  }
  std::erase_if(agreeing_, [&](std::int32_t i) {
    return !seen.claims[node_of(i)].pass(rules_, DecodeRule::kGroupTooFew, agrees_[node_of(i)] == kInGroup);
  });
}

/// Those that are still where they were in an earlier round are as they were then.
void GroupMender::align_members(const LetterScene& scene) {
  aligner_.clear();
  asked_of_.assign(scene.seen.size(), -1);
  for (const std::int32_t node : to_ask_) {
    const LetterPlace place = place_of(scene, node);
    if (place.held_by == 0) continue;
    const std::int32_t known = known_of_[node];
    if (known >= 0 && known_[known].letter.place == place) {
      asked_of_[node] = known;
    } else {
      aligner_.ask(scene, node, place);
    }
  }
  aligner_.align(scene);
  for (const AskedLetter& letter : aligner_.asked()) {
    const Member member{.letter = letter, .shows_letter = shows_letter(scene, letter)};
    std::int32_t& known = known_of_[letter.node];
    if (known < 0) {
      known = static_cast<std::int32_t>(known_.size());
      known_.push_back(member);
    } else {
      known_[known] = member;
    }
    asked_of_[letter.node] = known;
  }
}

void GroupMender::start(const Sightings& seen) {
  known_.clear();
  known_of_.assign(seen.size(), -1);
}

const std::vector<std::int32_t>& GroupMender::mend(const LetterScene& scene) {
  mended_.clear();
  if (!rules_.has(DecodeRule::kMendedInGroup)) return mended_;
  find_members(scene);
  align_members(scene);
  agreeing_.clear();
  for (const std::int32_t node : to_ask_)
    if (const std::int32_t i = asked_of_[node]; i >= 0 && known_[i].shows_letter) agreeing_.push_back(i);
  refuse_torn_lines(scene);
  keep_groups(scene.seen);
  for (const std::int32_t i : agreeing_) {
    aligner_.take_over(scene, known_[i].letter, DecodeRule::kMendedInGroup);
    mended_.push_back(known_[i].letter.node);
  }
  return mended_;
}

}  // namespace slsd
