// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/turns.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace slsd {
namespace {

using namespace std::chrono_literals;

std::chrono::nanoseconds g_now{};
std::chrono::nanoseconds now() {
  return g_now;
}

// Takes turns of some length, one after the other.
struct Client {
  Turns& turns;
  std::string& order;
  char name;
  std::chrono::milliseconds length;
  int left;
  Turns::Taker taker{};

  void ask() {
    turns.ask(taker, 0ns, [this] {
      order += name;
      g_now += length;
      if (--left > 0) ask();
    });
  }
};

TEST(Turns, GoToWhoUsedTheLeastTime) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  Client slow{turns, order, 'S', 20ms, 10};
  Client quick{turns, order, 'q', 2ms, 40};
  slow.ask();
  quick.ask();
  events.run();
  const std::string first = order.substr(0, 30);
  EXPECT_LT(std::ranges::count(first, 'S'), 12) << "of equal turns it would be half: " << order;
  EXPECT_EQ(std::ranges::count(order, 'S'), 10);
  EXPECT_EQ(std::ranges::count(order, 'q'), 40);
}

TEST(Turns, WhoComesAfterAWhileIsNext) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  std::vector<std::unique_ptr<Client>> floods;
  for (int i = 0; i < 20; ++i) floods.push_back(std::make_unique<Client>(Client{turns, order, 'f', 1ms, 20}));
  for (const auto& flood : floods) flood->ask();
  Client modest{turns, order, 'm', 0ms, 1};
  while (order.size() < 110) events.run_one();
  const std::size_t asked = order.size();
  modest.ask();
  events.run();
  EXPECT_LE(order.find('m') - asked, 2U) << order;
}

// A share of one in 64 would be used up by then.
TEST(Turns, WhoComesBackNowAndThenIsNext) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  std::vector<std::unique_ptr<Client>> floods;
  for (int i = 0; i < 64; ++i) floods.push_back(std::make_unique<Client>(Client{turns, order, 'f', 1ms, 20}));
  for (const auto& flood : floods) flood->ask();
  Client modest{turns, order, 'm', 1ms, 1};
  for (int i = 1; i <= 10; ++i) {
    while (order.size() < 64U + 30 * i) events.run_one();
    const std::size_t asked = order.size();
    modest.ask();
    while (order.find('m', asked) == std::string::npos) events.run_one();
    EXPECT_LE(order.find('m', asked) - asked, 3U) << "time " << i;
  }
}

// Nor do many who each come back now and then, and leave no time between them.
TEST(Turns, LongOnesHaveTheirShareBesideManyWhoComeBack) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  std::vector<std::unique_ptr<Client>> many;
  for (int i = 0; i < 40; ++i) many.push_back(std::make_unique<Client>(Client{turns, order, 'q', 1ms, 1}));
  Client slow{turns, order, 'S', 20ms, 1};
  many.front()->ask();
  slow.ask();
  for (int i = 1; order.find('S') == std::string::npos && i < 2000; ++i) {
    many[i % 40]->ask();
    const std::size_t before = order.size();
    while (order.size() == before) events.run_one();
  }
  EXPECT_LT(order.find('S'), 1000U);
}

// The floods' turns are long, and all begin at about the same time: quick ones in a row do not wait for them.
TEST(Turns, QuickOnesDoNotWaitForLongOnesOfAllOthers) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  std::vector<std::unique_ptr<Client>> floods;
  for (int i = 0; i < 20; ++i) floods.push_back(std::make_unique<Client>(Client{turns, order, 'f', 20ms, 5}));
  for (const auto& flood : floods) flood->ask();
  while (order.size() < 25) events.run_one();
  Client quick{turns, order, 'q', 1ms, 4};
  quick.ask();
  events.run();
  EXPECT_LE(order.rfind('q'), 25U + 8U) << order;
}

// One that is always there again for a quick turn does not keep the long ones out for ever.
TEST(Turns, LongOnesHaveTheirShare) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  Client slow{turns, order, 'S', 20ms, 3};
  Client quick{turns, order, 'q', 1ms, 200};
  quick.ask();
  slow.ask();
  events.run();
  EXPECT_LT(order.rfind('S'), 90U) << order;
}

TEST(Turns, ForgetsWhoAsked) {
  asio::io_context events;
  Turns turns(events, now);
  std::string order;
  Client client{turns, order, 'c', 0ms, 1};
  client.ask();
  turns.clear();
  events.run();
  EXPECT_EQ(order, "");
}

}  // namespace
}  // namespace slsd
