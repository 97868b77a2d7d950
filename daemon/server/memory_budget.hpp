// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace slsd {

/// Bounds the memory of all clients together: requests being received, replies and events being made or sent, clouds
/// waiting for subscribers, and lent memfds. Bytes that several clients share count for each of them, so the count is
/// never less than the memory held.
///
/// One rule shares it (dynamic thresholds: Choudhury and Hahne 1998): no client may hold more than is then free for all
/// others. One client alone gets a half; two greedy clients get a third each; a hundred get about a hundredth each, and
/// leave as much free. So clients that ask for much wait, and clients that ask for little are served at once.
///
/// The connections of one user may count as one client, so that opening many gains nothing.
///
/// A few bytes are always granted, because every request must get a reply. They come on top: at most 20 kB for each
/// part of a client's memory.
/// @thread thread-bound
class MemoryBudget {
 public:
  explicit MemoryBudget(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  [[nodiscard]] std::size_t limit() const { return limit_bytes_; }
  [[nodiscard]] std::size_t held() const { return held_; }
  /// The limit of one client when no other holds anything.
  [[nodiscard]] std::size_t limit_of_one() const { return limit_bytes_ / 2; }

  /// Grants memory that outlives its client, such as lent clouds: at most a half in all.
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

  /// @param user  accounts of the same user count as one client; without a user, this account is a client of its own
  explicit MemoryAccount(MemoryBudget& budget, std::optional<std::uint32_t> user = std::nullopt)
      : budget_(budget), user_(user) {}
  ~MemoryAccount();
  MemoryAccount(const MemoryAccount&) = delete;
  MemoryAccount& operator=(const MemoryAccount&) = delete;

  /// Changes the part's size and returns whether that is allowed; if not, the size stays. A smaller size, or one up to
  /// 20 kB, is always allowed.
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
