// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/configuration/access.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <gmock/gmock.h>

#include "daemon/configuration/server_options.hpp"

namespace slsd {
namespace {

using testing::HasSubstr;

constexpr uid_t kStranger = 54321;
constexpr gid_t kOwnGroup = 54322;
constexpr gid_t kDaemonGroup = 1;  // of every Debian, as is the user "daemon"
constexpr uid_t kDaemonUser = 1;

ServerOptions options_of(std::vector<std::string> observe, std::vector<std::string> scan,
                         std::vector<std::string> administer) {
  ServerOptions options;
  options.observe = std::move(observe), options.scan = std::move(scan), options.administer = std::move(administer);
  return options;
}

TEST(AccessRules, LetEveryoneScanAndStrangersAdministerNothingByDefault) {
  const auto rules = AccessRules::of({});
  ASSERT_TRUE(rules) << to_string(rules.error());  // also where nobody has made the group
  EXPECT_EQ(rules->role_of({kStranger, kOwnGroup, 1, {}}), Role::kScan);
  EXPECT_EQ(rules->role_of({0, 0, 1, {}}), Role::kAdminister);
  EXPECT_EQ(rules->role_of({::geteuid(), kOwnGroup, 1, {}}), Role::kAdminister);
}

TEST(AccessRules, GoByUserByGroupAndByTheOtherGroups) {
  const auto rules = AccessRules::of(options_of({"@daemon"}, {"daemon"}, {}));
  ASSERT_TRUE(rules) << to_string(rules.error());
  EXPECT_EQ(rules->role_of({kDaemonUser, kOwnGroup, 1, {}}), Role::kScan);
  EXPECT_EQ(rules->role_of({kStranger, kDaemonGroup, 1, {}}), Role::kObserve);
  EXPECT_EQ(rules->role_of({kStranger, kOwnGroup, 1, {kOwnGroup, kDaemonGroup}}), Role::kObserve);
  EXPECT_EQ(rules->role_of({kStranger, kOwnGroup, 1, {kOwnGroup}}), Role::kNone);
}

TEST(AccessRules, SayWhatGivesARole) {
  const auto rules = AccessRules::of(options_of({"*"}, {"daemon"}, {"daemon", "@daemon"}));
  ASSERT_TRUE(rules);
  EXPECT_THAT(rules->way_to(Role::kScan), HasSubstr("[server] scan"));
  EXPECT_THAT(rules->way_to(Role::kAdminister), HasSubstr("the group daemon, then log in again"));
}

TEST(AccessRules, RefuseNamesThatTheHostDoesNotKnow) {
  for (const char* const name : {"@nobody-made-this", "nobody-is-called-this"}) {
    const auto rules = AccessRules::of(options_of({"*"}, {name}, {}));
    ASSERT_FALSE(rules);
    EXPECT_EQ(rules.error().code, ErrorCode::kNotFound);
    EXPECT_THAT(rules.error().message,
                testing::AllOf(HasSubstr("scan names"), HasSubstr("does not exist on this host")));
  }
  for (const char* const name : {"", "@"}) {
    const auto rules = AccessRules::of(options_of({name}, {}, {}));
    ASSERT_FALSE(rules);
    EXPECT_EQ(rules.error().code, ErrorCode::kInvalidArgument);
  }
}

TEST(PeerOf, IsWhoTheKernelSays) {
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const Peer peer = peer_of(ends[0]);
  EXPECT_EQ(peer.user, ::geteuid());
  EXPECT_EQ(peer.group, ::getegid());
  EXPECT_EQ(peer.process, ::getpid());
  std::vector<gid_t> groups(64);
  groups.resize(static_cast<std::size_t>(std::max(0, ::getgroups(64, groups.data()))));
  EXPECT_THAT(peer.groups, testing::UnorderedElementsAreArray(groups));
  ::close(ends[0]), ::close(ends[1]);
  EXPECT_EQ(AccessRules::of({}).value().role_of(peer_of(-1)), Role::kScan);  // anyone
  EXPECT_EQ(AccessRules::of(options_of({"daemon"}, {}, {})).value().role_of(peer_of(-1)), Role::kNone);
}

}  // namespace
}  // namespace slsd
