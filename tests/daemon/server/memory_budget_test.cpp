// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/memory_budget.hpp"

#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

namespace slsd {
namespace {

using Part = MemoryAccount::Part;

constexpr std::size_t kMB = 1 << 20;

TEST(MemoryBudget, OneClientGetsAHalf) {
  MemoryBudget budget(100 * kMB);
  MemoryAccount account(budget);
  EXPECT_FALSE(account.resize(Part::kReply, 51 * kMB));
  EXPECT_EQ(budget.held(), 0U);
  EXPECT_TRUE(account.resize(Part::kReply, 50 * kMB));
  EXPECT_FALSE(account.resize(Part::kEvent, kMB));
  EXPECT_TRUE(account.resize(Part::kReply, 10 * kMB)) << "to need less is always right";
  EXPECT_TRUE(account.resize(Part::kEvent, 40 * kMB));
  EXPECT_FALSE(account.resize(Part::kRequest, SIZE_MAX));
}

TEST(MemoryBudget, ModestClientsAreServedBesideGreedyOnes) {
  MemoryBudget budget(512 * kMB);
  std::vector<std::unique_ptr<MemoryAccount>> greedy;
  for (int i = 0; i < 20; ++i) {
    greedy.push_back(std::make_unique<MemoryAccount>(budget));
    for (std::size_t mb = 1; greedy.back()->resize(Part::kReply, mb * kMB); ++mb) {
    }
  }
  MemoryAccount modest(budget);
  EXPECT_TRUE(modest.resize(Part::kRequest, kMB / 16));
  EXPECT_TRUE(greedy.back()->resize(Part::kEvent, 20 << 10)) << "an error is always told";
  greedy.clear();
  EXPECT_EQ(budget.held(), kMB / 16);
}

TEST(MemoryBudget, ManyConnectionsOfOneUserAreOneClient) {
  constexpr std::uint32_t kGreedy = 1000, kOther = 1001;
  MemoryBudget budget(512 * kMB);
  {
    std::vector<std::unique_ptr<MemoryAccount>> greedy;
    for (int i = 0; i < 20; ++i) {
      greedy.push_back(std::make_unique<MemoryAccount>(budget, kGreedy));
      for (std::size_t mb = 1; greedy.back()->resize(Part::kReply, mb * kMB); ++mb) {
      }
    }
    EXPECT_EQ(budget.held(), 256 * kMB);
    MemoryAccount other(budget, kOther);
    EXPECT_TRUE(other.resize(Part::kReply, 128 * kMB)) << "as if the user had one connection";
    greedy.front()->release(Part::kReply);
    greedy.pop_back();
  }
  EXPECT_EQ(budget.held(), 0U);
  MemoryAccount again(budget, kGreedy);
  EXPECT_TRUE(again.resize(Part::kReply, 256 * kMB)) << "what its connections held is given back";
}

TEST(MemoryBudget, LendsAtMostAHalf) {
  MemoryBudget budget(100 * kMB);
  EXPECT_TRUE(budget.lend(50 * kMB));
  EXPECT_FALSE(budget.lend(1));
  MemoryAccount account(budget);
  EXPECT_TRUE(account.resize(Part::kReply, 25 * kMB));
  budget.give_back(50 * kMB);
  EXPECT_EQ(budget.held(), 25 * kMB);
}

// Whatever clients ask for and give back, all of it together is within the limit, but for what is always granted.
RC_GTEST_PROP(MemoryBudget, IsKept, ()) {
  constexpr std::size_t kLimit = 10 * kMB;
  MemoryBudget budget(kLimit);
  std::vector<std::unique_ptr<MemoryAccount>> accounts;
  for (int i = 0; i < 5; ++i) accounts.push_back(std::make_unique<MemoryAccount>(budget));
  for (int step = 0; step < 50; ++step) {
    const auto index = *rc::gen::inRange<std::size_t>(0, accounts.size());
    const auto part = static_cast<Part>(*rc::gen::inRange(0, 3));
    (void)accounts[index]->resize(part, *rc::gen::inRange<std::size_t>(0, kLimit));
    std::size_t sum = 0;
    for (const auto& account : accounts) sum += account->held();
    RC_ASSERT(budget.held() == sum);
    RC_ASSERT(sum <= kLimit + accounts.size() * 3 * (20 << 10));
  }
  accounts.clear();
  RC_ASSERT(budget.held() == 0U);
}

}  // namespace
}  // namespace slsd
