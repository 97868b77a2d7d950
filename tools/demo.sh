# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Runs the service on a recorded frame.

# write_configuration SCENE SOCKET
write_configuration() {
  cat <<TOML
[pattern]
file = "$1/pattern.toml"
[projector]
driver = "headless"
[[camera]]
name = "camera"
driver = "file"
path = "$1/frame.png"
[calibration]
file = "$1/calibration.yml"
[server]
socket = "$2"
TOML
}

service=''
runtime=''
stop_service() {
  local status=0
  [ -z "$service" ] || { kill "$service" 2>/dev/null; wait "$service" || status=$?; }
  service=''
  [ -z "$runtime" ] || rm -rf "$runtime"
  return $status
}

# start_service SCENE FOLDER PRESET: sets `service` to the process and `socket` to its socket.
start_service() {
  local scene=$PWD/tests/corpus/$1 out=$2 bin=build/$3/bin
  [ -e "$scene/frame.png" ] || die "no recorded scene '$1' in tests/corpus; there are: $(cd tests/corpus && echo */)"
  mkdir -p "$out"
  runtime=$(mktemp -d)  # a socket's path has 107 characters at most, too few for a deep checkout
  socket=$runtime/slsd.sock
  trap 'stop_service || true' EXIT
  write_configuration "$scene" "$socket" >"$out/slsd.toml"
  say "starting slsd on $scene/frame.png, log in $out/slsd.log"
  "$bin/slsd" --config "$out/slsd.toml" >"$out/slsd.log" 2>&1 &
  service=$!
  local i
  for ((i = 0; i < 100; ++i)); do
    [ ! -S "$socket" ] || return 0
    kill -0 "$service" 2>/dev/null || break
    sleep 0.1
  done
  cat "$out/slsd.log" >&2
  die "slsd did not open its socket"
}

do_demo() {
  local out=out/demo
  build demo slsd slsctl
  start_service "${1:-8px-6-bust-near}" $out demo
  say "scanning over the socket"
  build/demo/bin/slsctl --socket "$socket" scan -o $out/cloud.ply \
    --picture $out/decoded.png --cloud-picture $out/cloud.png
  say "measuring every pixel of it"
  build/demo/bin/slsctl --socket "$socket" scan --density pixels --timeout-ms 60000 -o $out/dense.ply \
    --cloud-picture $out/dense.png
  say "stopping slsd"
  stop_service
  say "wrote $(echo $out/*.ply $out/*.png)"
}

do_soak() {
  need "${test_packages[@]}"
  build release slsd
  start_service "${2:-16px-5-bust}" out/soak release
  tests/daemon/soak.py "$socket" "$service" --scans "${1:-10000}"
  stop_service
}
