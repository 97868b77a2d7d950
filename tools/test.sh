# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Builds and runs tests.

# run_tests PRESET [OPTION OF CTEST...]: runs three tests per processor, because many wait more than they work; two if
# they are instrumented and work longer. Reports skipped tests; in CI (CI=true) only those of tests/skips.txt may skip.
# Ends with what failed tests printed.
run_tests() {
  local preset=$1 results=$PWD/build/$1/tests.xml status=0 per_processor=2
  [ "$preset" != release ] || per_processor=3
  export TZ=${TZ-Asia/Kathmandu}  # on a machine set to UTC, a test would not notice local time in its place
  shift
  rm -f "$results"
  ctest --preset "$preset" --parallel $((per_processor * $(nproc))) --output-junit "$results" --test-output-size-passed 1000000 "$@" || status=$?
  [ ! -e "$results" ] || tests/skips.py "$results" || status=1
  [ ! -e "$results" ] || tests/failures.py "$results"
  return $status
}

has_tests() { [ -e "tests/$1/CMakeLists.txt" ] || compgen -G "tests/$1/*/CMakeLists.txt" >/dev/null; }

# test_alone ROOM...: builds and tests these without all others.
test_alone() {
  local room more packages=("${core_packages[@]}")
  for room; do
    read -ra more < <(room_packages "$room")
    packages+=("${more[@]}")
  done
  need "${packages[@]}"
  say "building $* into build/core"
  configure core -DSLSD_ROOMS="$(IFS=';'; echo "$*")"
  cmake --build --preset core
  run_tests core --no-tests=error
}

# test_among_all ROOM FOLDER...: builds and runs the tests in these folders.
test_among_all() {
  local room=$1
  shift
  need "${test_packages[@]}"
  get_aravis_tools release
  case $room in clients*) get_ros ;; esac
  build release "${@/%//all}"
  run_tests release --label-regex "^$room(/|\$)" --no-tests=error
}

# do_test_room ROOM: a room without a test program is tested by that of the room around it.
do_test_room() {
  local asked=${1%/} room folders
  asked=${asked#tests/}
  room=$asked
  [ -n "$room" ] || die "name a room, as core/geometry"
  [ -d "$room" ] || [ -d "tests/$room" ] || die "there is no room $1: name a folder, as core/geometry"
  until has_tests "$room"; do
    case $room in
      */*) room=${room%/*} ;;
      *) die "there are no tests of $1: see the folders of tests/" ;;
    esac
  done
  [ "$room" = "$asked" ] || say "the tests of $asked are among those of $room"
  folders=(tests/"$room")
  [ -e "tests/$room/CMakeLists.txt" ] || mapfile -t folders < <(dirname tests/"$room"/*/CMakeLists.txt)
  case $room in
    core | core/* | picture | simulator) test_alone "${folders[@]#tests/}" ;;
    *) test_among_all "$room" "${folders[@]}" ;;
  esac
  say "all tests of $room passed"
}

# In CI (CI=true) lint looks at what changed, and sanitizers at text, code and geometry of core.
do_test() {
  if [ $# -gt 0 ]; then
    [ $# -eq 1 ] || refuse
    do_test_room "$1"
    return
  fi
  need "${build_packages[@]}" "${test_packages[@]}"
  if [ "${CI:-}" = true ]; then
    do_lint --changed
  elif can_check_format; then
    say "checking the format"
    check_format
  fi
  build release
  get_aravis_tools release
  get_ros
  run_tests release
  [ "${CI:-}" != true ] || do_sanitize --core
  say "all tests passed"
}

# For sanitize --quick: rooms that share memory between threads, parse what strangers send, or hold devices. Core
# computes, which is slow under a sanitizer. Paced cameras, hung X servers and soaks take long and find little.
quick_rooms='^(drivers(/projector)?|rpc|daemon|clients|programs)$'
quick_tests='^(daemon\.(make_scene|service|waiting|logging|rubbish|subscribe|life|command_line|project|record|texture)$|[A-Z])'
quick_passed_over='(/(CameraContract|ProjectorContract)\.|Latency|Soak|Pace|Calibrat|Session\.|LateLight|OnXvfb\.|OnTwoMonitors\.)'

do_sanitize() {
  need "${test_packages[@]}" "${fuzz_packages[@]}"  # clang needs a third of the time that GCC takes for these builds
  local preset presets=(asan tsan) targets=() choice=()
  case ${1:-} in
    '') ;;
    --core) presets=(core-asan) ;;
    --quick)
      targets=(quick_tests)  # of tests/CMakeLists.txt
      choice=(--label-regex "$quick_rooms" --tests-regex "$quick_tests" --exclude-regex "$quick_passed_over" --no-tests=error) ;;
    *) refuse ;;
  esac
  for preset in "${presets[@]}"; do
    build "$preset" ${targets:+"${targets[@]}"}
    run_tests "$preset" ${choice:+"${choice[@]}"}
  done
}

do_fuzz() {
  need "${fuzz_packages[@]}"
  build fuzz fuzzers
  local seconds=${1:-60} fuzzer what
  for fuzzer in build/fuzz/bin/fuzz_*; do
    what=$(basename "$fuzzer"); what=${what#fuzz_}
    say "fuzzing $what for $seconds s"
    mkdir -p "out/fuzz/$what"
    "$fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 -verbosity=0 \
      -artifact_prefix="out/fuzz/$what-" "out/fuzz/$what" "tests/fuzz/seeds/$what"
  done
}

do_mutate() {
  need "${build_packages[@]}" "${test_packages[@]}"
  tests/mutate.py "$@"
}

do_coverage() {
  need "${test_packages[@]}" "${coverage_packages[@]}"
  build coverage
  run_tests coverage
  mkdir -p out/coverage
  gcovr --root . --filter core/ --filter picture/ --filter drivers/ --filter rpc/ --filter daemon/ \
    --filter clients/slsctl/ --filter clients/connection/ --filter clients/usage/ --filter programs/ --exclude-throw-branches \
    --html-details out/coverage/index.html --txt - build/coverage
}
