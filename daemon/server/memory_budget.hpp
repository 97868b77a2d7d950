// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace slsd {

/// Bounds the memory of all clients together: requests that are being collected, replies and events that are being made
/// or sent, clouds that wait for their subscribers, and those that were lent as memfds. Bytes that several clients
/// share count for each of them, so that what is counted is never less than what is held.
///
/// It is shared by one rule (dynamic thresholds: Choudhury and Hahne 1998): no client may come to hold more than is
/// then free for all the others. One alone gets a half, two that take all they can a third each, and a hundred and one
/// leave a hundredth free: who asks for more waits, and who asks for little is served as if nobody else were there.
///
/// The connections of one user may count as one client, so that nobody gets more by opening many.
///
/// A few bytes are always granted, as each request is to have a reply: they come on top, at most 20 kB for each part of
/// a client's.
/// @thread thread-bound
class MemoryBudget {
 public:
  explicit MemoryBudget(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  [[nodiscard]] std::size_t limit() const { return limit_bytes_; }
  [[nodiscard]] std::size_t held() const { return held_; }
  /// The limit of one client while no other holds anything.
  [[nodiscard]] std::size_t limit_of_one() const { return limit_bytes_ / 2; }

  /// Memory that outlives its client, as clouds that are lent: all of it together at most a half.
  [[nodiscard]] bool lend(std::size_t bytes);
  void give_back(std::size_t bytes);
  [[nodiscard]] std::size_t lent() const { return lent_; }

 private:
  friend class MemoryAccount;
  std::size_t limit_bytes_;
  std::size_t held_ = 0;  ///< bytes held, including those lent
  std::size_t lent_ = 0;
  std::map<std::uint32_t, std::size_t> held_by_user_;  ///< bytes of the accounts that count as one client
};

/// One client's account with the budget.
/// @thread thread-bound
class MemoryAccount {
 public:
  enum class Part { kRequest, kReply, kEvent, kWaiting };

  /// @param user  whose accounts count as one client; without one this account is a client
  explicit MemoryAccount(MemoryBudget& budget, std::optional<std::uint32_t> user = std::nullopt)
      : budget_(budget), user_(user) {}
  ~MemoryAccount();
  MemoryAccount(const MemoryAccount&) = delete;
  MemoryAccount& operator=(const MemoryAccount&) = delete;

  /// Changes the part's size, and tells whether it may be so large; else it stays as it was. A smaller size, or one up
  /// to 20 kB, is always granted.
  [[nodiscard]] bool resize(Part part, std::size_t bytes);
  void release(Part part) { set(part, 0); }
  [[nodiscard]] std::size_t held() const;

 private:
  void set(Part part, std::size_t bytes);

  MemoryBudget& budget_;
  std::optional<std::uint32_t> user_;
  std::array<std::size_t, 4> parts_{};
};

}  // namespace slsd
