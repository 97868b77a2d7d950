# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Checks format, wording, scripts and code.

formatter=clang-format-14  # other versions break lines elsewhere
linted_rooms=(core picture drivers rpc daemon clients/{connection,usage,slsctl} programs)

sources() { git ls-files '*.hpp' '*.cpp'; }
check_format() { sources | xargs "$formatter" --dry-run -Werror; }
can_check_format() { command -v "$formatter" && sources; } >/dev/null 2>&1

# Prints the sources that changed last, uncommitted changes first: twelve, which take clang-tidy two minutes on two cores.
changed_sources() {
  { git diff --name-only HEAD; git log --max-count=100 --format= --name-only; } | sed 's/\.hpp$/.cpp/' |
    grep -Fxf <(git ls-files "${linted_rooms[@]}" | grep '\.cpp$') | awk '!seen[$0]++' | head -n 12
}

# run_clang_tidy SOURCE...
run_clang_tidy() {
  [ $# -gt 0 ] || return 0
  need "${build_packages[@]}"
  # One command per source, and no precompiled headers, because GCC's are of no use to Clang.
  cmake --preset dev -B build/lint -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
  say "running clang-tidy over $# sources"
  run-clang-tidy -quiet -p build/lint "${@/#/$PWD/}"
}

# do_lint [--changed | PATH...]
do_lint() {
  local sources=() paths=("$@")
  [ $# -gt 0 ] || paths=("${linted_rooms[@]}")
  need "${lint_packages[@]}"
  say "checking the format"
  check_format
  say "checking the wording"
  tests/wording.py
  say "checking the scripts"
  shellcheck --external-sources --check-sourced run .ci/run tests/machine/make_guest.sh
  if [ "${1:-}" = --changed ]; then
    mapfile -t sources < <(changed_sources)
  else
    mapfile -t sources < <(git ls-files "${paths[@]}" | grep '\.cpp$')
    [ ${#sources[@]} -gt 0 ] || die "no source in ${paths[*]}"
  fi
  run_clang_tidy "${sources[@]}"
}

do_format() {
  need "${lint_packages[@]}"
  sources | xargs "$formatter" -i
}
