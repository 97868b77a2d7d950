// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/session.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <asio/io_context.hpp>
#include <asio/post.hpp>

#include "drivers/system/file_descriptor.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr auto kTimeout = 60s;

std::string request(const std::string& method, int id = 1) {
  return R"({"jsonrpc":"2.0","id":)" + std::to_string(id) + R"(,"method":")" + method + "\"}\n";
}

std::string notification(const std::string& method) {
  return R"({"jsonrpc":"2.0","method":")" + method + "\"}\n";
}

// A client and its session. "echo" is answered at once, "wait" when the test says so.
class SessionTest : public ::testing::Test {
 protected:
  void connect(ServerOptions options = {}) {
    room_ = std::make_shared<SessionRoom>(events_, options);
    room_->handler = [this](const Request& asked, Session& session, Respond respond) {
      methods_.push_back(asked.method);
      gone_ = session.gone();
      if (asked.method == "reserve") {
        if (auto refused = session.reserve(1ULL << 40U)) return respond(tl::unexpected(*refused));
      }
      if (asked.method == "slow") std::this_thread::sleep_for(1ms);
      if (asked.method == "wait") {
        respond_ = std::move(respond);
      } else {
        respond(Reply{{{"method", asked.method}}});
      }
    };
    room_->ended = [this](Session&, bool) { ended_ = true; };
    std::array<int, 2> sockets{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets.data()), 0);
    client_ = FileDescriptor(sockets[0]);
    Session::Socket socket(events_, asio::local::stream_protocol(), sockets[1]);
    session_ = std::make_shared<Session>(std::move(socket), room_);
    session_->start();
  }
  void TearDown() override {
    respond_ = {};
    if (session_) session_->end();
    if (room_) room_->turns.clear();
  }

  void send(const std::string& bytes) const {
    ASSERT_EQ(::send(client_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  void run_until(const std::function<bool()>& done) {
    const auto end = std::chrono::steady_clock::now() + kTimeout;
    bool is_done = done();
    while (!is_done && std::chrono::steady_clock::now() < end) {
      events_.restart();
      events_.run_one_for(1ms);
      is_done = done();
    }
    EXPECT_TRUE(is_done);
  }
  // Long enough for what would be wrong; a slow machine may miss it, and never sees what is not there.
  void run_a_while() {
    const auto end = std::chrono::steady_clock::now() + 100ms;
    while (std::chrono::steady_clock::now() < end) {
      events_.restart();
      events_.run_one_for(1ms);
    }
  }
  void take() {
    std::array<char, 4096> chunk;
    const ssize_t size = ::recv(client_.number(), chunk.data(), chunk.size(), MSG_DONTWAIT);
    if (size > 0) received_.append(chunk.data(), static_cast<std::size_t>(size));
  }
  std::string receive_until(const std::string& part) {
    run_until([&] { return take(), received_.find(part) != std::string::npos; });
    return std::exchange(received_, {});
  }
  void publish_failure() {
    session_->publish(
        std::make_shared<Publication>(std::make_shared<const Result<ScanResult>>(fail(ErrorCode::kFrameLate, "late"))),
        0);
  }

  asio::io_context events_;
  std::shared_ptr<SessionRoom> room_;
  std::shared_ptr<Session> session_;
  FileDescriptor client_;
  std::string received_;
  std::vector<std::string> methods_;
  std::stop_token gone_;
  Respond respond_;
  bool ended_ = false;
};

TEST_F(SessionTest, AnswersInOrder) {
  connect();
  send(request("wait", 1) + request("echo", 2));
  run_until([&] { return bool(respond_); });
  run_a_while();
  EXPECT_THAT(methods_, ::testing::ElementsAre("wait"));
  respond_(Reply{{{"first", true}}});
  const std::string replies = receive_until("echo");
  EXPECT_LT(replies.find("first"), replies.find("echo"));
}

// The client subscribes, asks without a line end, and shuts down writing: an event was taken for the answer.
TEST_F(SessionTest, EventIsNoReply) {
  connect();
  send(request("echo"));
  receive_until("echo");
  session_->subscribe(Subscription(CloudFormat::kPly, std::nullopt));
  std::string last = request("wait", 7);
  last.pop_back();
  send(last);
  ::shutdown(client_.number(), SHUT_WR);
  run_until([&] { return bool(respond_); });
  publish_failure();
  receive_until("scan_failed");
  run_a_while();
  ASSERT_FALSE(ended_);
  respond_(Reply{{{"done", true}}});
  EXPECT_THAT(receive_until("\"id\":7"), HasSubstr("done"));
  publish_failure();
  EXPECT_THAT(receive_until("scan_failed"), HasSubstr("late")) << "who shut down writing still listens";
  client_ = FileDescriptor();
  run_until([&] { return ended_; });
}

TEST_F(SessionTest, HalfClosedIsNotGone) {
  connect();
  send(request("wait"));
  ::shutdown(client_.number(), SHUT_WR);
  run_until([&] { return bool(respond_); });
  run_a_while();
  EXPECT_FALSE(gone_.stop_requested());
  respond_(Reply{{{"done", true}}});
  EXPECT_THAT(receive_until("done"), EndsWith("\n"));
  run_until([&] { return ended_; });
}

TEST_F(SessionTest, HangUpIsSeenWhileARequestIsUnderWay) {
  connect();
  send(request("wait") + request("echo"));
  run_until([&] { return bool(respond_); });
  EXPECT_FALSE(gone_.stop_requested());
  client_ = FileDescriptor();
  run_until([&] { return gone_.stop_requested(); });
  run_until([&] { return ended_; });
  respond_(Reply{{{"done", true}}});  // goes nowhere
  EXPECT_THAT(methods_, ::testing::ElementsAre("wait")) << "nobody waits for the second either";
}

TEST_F(SessionTest, WhatNobodyWaitsForIsNotGivenUp) {
  connect();
  send(notification("wait") + request("echo") + notification("last"));
  client_ = FileDescriptor();
  run_until([&] { return bool(respond_); });
  run_a_while();
  EXPECT_FALSE(gone_.stop_requested());
  EXPECT_FALSE(ended_);
  respond_(Reply{});
  run_until([&] { return ended_; });
  EXPECT_THAT(methods_, ::testing::ElementsAre("wait", "last"));
}

// Urgent bytes make the socket look as if it had failed, until they are read.
TEST_F(SessionTest, UrgentBytesAreNoHangUp) {
  connect();
  send(request("wait"));
  run_until([&] { return bool(respond_); });
  if (::send(client_.number(), "!", 1, MSG_OOB) != 1) GTEST_SKIP() << "this kernel has none on such sockets";
  const auto rounds = [&] {
    std::size_t count = 0;
    const auto end = std::chrono::steady_clock::now() + 100ms;
    for (; std::chrono::steady_clock::now() < end; ++count) {
      events_.restart();
      events_.run_one_for(10ms);
    }
    return count;
  };
  EXPECT_LT(rounds(), 100U) << "and does not keep the event loop busy";
  EXPECT_FALSE(gone_.stop_requested());
  client_ = FileDescriptor();
  run_until([&] { return gone_.stop_requested(); });
}

TEST_F(SessionTest, TooLongALineIsAnsweredAndEnds) {
  connect({.request_bytes_max = 1024});
  send(request("echo") + std::string(5000, 'x'));
  const std::string replies = receive_until("the connection ends");
  EXPECT_THAT(replies, HasSubstr("echo"));
  run_until([&] { return ended_; });
}

TEST_F(SessionTest, LastLineTooLongIsNoRequest) {
  connect({.request_bytes_max = 1024});
  send(R"({"jsonrpc":"2.0","id":1,"method":"echo","params":{"a":")" + std::string(2000, 'x') + "\"}}");
  ::shutdown(client_.number(), SHUT_WR);
  receive_until("the connection ends");
  EXPECT_THAT(methods_, IsEmpty());
  run_until([&] { return ended_; });
}

TEST_F(SessionTest, EndsWhenTheClientShutDownAndAllIsSent) {
  connect();
  send(request("echo"));
  ::shutdown(client_.number(), SHUT_WR);
  receive_until("echo");
  run_until([&] { return ended_; });
}

TEST_F(SessionTest, WindsDownWhenTheReplyIsSent) {
  connect();
  send(request("wait"));
  run_until([&] { return bool(respond_); });
  session_->wind_down();
  EXPECT_FALSE(ended_);
  const auto cloud = std::make_shared<const std::string>(4 << 20, 'c');
  respond_(Reply{{{"bytes", cloud->size()}}, cloud});
  EXPECT_TRUE(session_->is_sending_since(std::chrono::steady_clock::now() - 1s));
  EXPECT_FALSE(session_->is_sending_since(std::chrono::steady_clock::now() + 1s));
  std::size_t size = 0;
  run_until([&] { return take(), size += std::exchange(received_, {}).size(), ended_ && size > cloud->size(); });
  session_->wind_down();
}

TEST_F(SessionTest, IdleEndsAtOnceWhenItWindsDown) {
  connect();
  session_->wind_down();
  EXPECT_TRUE(ended_);
}

// One byte now and then set the timer anew: such a client was never dropped.
TEST_F(SessionTest, WhoReadsByBytesIsDropped) {
  connect({.send_timeout_ms = 300});
  send(request("wait"));
  run_until([&] { return bool(respond_); });
  respond_(Reply{{}, std::make_shared<const std::string>(4 << 20, 'c')});
  run_until([&] {
    char byte = 0;
    return ::recv(client_.number(), &byte, 1, MSG_DONTWAIT), ended_;
  });
  EXPECT_EQ(room_->traffic.dropped, 1U);
}

TEST_F(SessionTest, WhoTakesAMegabyteInTimeIsNotDropped) {
  connect({.send_timeout_ms = 1500});
  send(request("wait"));
  run_until([&] { return bool(respond_); });
  constexpr std::size_t kSize = 8 << 20;
  respond_(Reply{{}, std::make_shared<const std::string>(kSize, 'c')});
  std::string chunk(400'000, '\0');
  std::size_t size = 0;
  auto next = std::chrono::steady_clock::now();
  run_until([&] {  // takes longer than the timeout, all together
    if (std::chrono::steady_clock::now() < next) return false;
    next += 50ms;
    const ssize_t taken = ::recv(client_.number(), chunk.data(), chunk.size(), MSG_DONTWAIT);
    size += taken > 0 ? static_cast<std::size_t>(taken) : 0;
    return size > kSize || ended_;
  });
  EXPECT_FALSE(ended_);
  EXPECT_EQ(room_->traffic.dropped, 0U);
}

TEST_F(SessionTest, TellsWhoAsksForMoreThanThereIs) {
  connect();
  send(request("reserve"));
  EXPECT_THAT(receive_until("\n"), ::testing::AllOf(HasSubstr("\"busy\""), HasSubstr("memory_max_mb is 512")));
  send(request("wait"));
  run_until([&] { return bool(respond_); });
  respond_(Reply{{}, std::make_shared<const std::string>(300 << 20, 'c')});
  EXPECT_THAT(receive_until("\n"), HasSubstr("one client gets at most half"));
  send(request("echo"));
  receive_until("echo");
  EXPECT_LT(room_->memory.held(), 1U << 20U);
}

TEST_F(SessionTest, CountsARequestThatIsCollected) {
  connect();
  const std::string part(100'000, 'x');
  send(part);
  run_until([&] { return room_->memory.held() >= part.size(); });
  send("\n");
  receive_until("not JSON");
  run_until([&] { return room_->memory.held() < 100'000; });
}

// Clouds of 3 MB for one who reads none: of 16 MB one client gets at most half.
TEST_F(SessionTest, CountsCloudsThatWait) {
  ServerOptions options;
  options.memory_max_mb = 16;
  connect(options);
  session_->subscribe(Subscription(CloudFormat::kPly, std::nullopt));
  ScanResult scan;
  scan.cloud.points.resize((3 << 20) / sizeof(CloudPoint));
  for (int i = 0; i < 4; ++i) {
    session_->publish(std::make_shared<Publication>(std::make_shared<const Result<ScanResult>>(scan)), 0);
    EXPECT_GT(room_->memory.held(), 2U << 20U);
    EXPECT_LE(room_->memory.held(), 8U << 20U);
  }
  EXPECT_GT(room_->memory.held(), 5U << 20U) << "one is being sent, and one waits";
  session_->unsubscribe();
  EXPECT_LT(room_->memory.held(), 5U << 20U) << "what is being sent";
}

TEST_F(SessionTest, ManyLinesDoNotHoldUpTheLoop) {
  connect();
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += notification("slow");
  send(lines);
  bool posted = false;
  run_until([&] { return !methods_.empty(); });
  asio::post(events_, [&] { posted = true; });
  run_until([&] { return posted; });
  EXPECT_LT(methods_.size(), 50U);
  run_until([&] { return methods_.size() == 100; });
}

}  // namespace
}  // namespace slsd
