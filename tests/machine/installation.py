# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What a whole machine shows of the packages and units, in a container as in a guest: each part is a function of the
machine that returns what it proved."""
import json
import re
import time

import lifecycle
from machine import field_of, require, wait_for

CALIBRATION = "/var/lib/slsd/calibration.yml"


def nothing_plugged_in(machine):
    begin = time.monotonic()
    machine.shell("apt-get install -y -q --no-install-recommends /packages/this/*.deb")
    require(machine.is_active("slsd.service"), "slsd.service is not active")
    require(not machine.is_active("slsd-display.service"), "slsd-display started unasked")
    for user, groups in (("alice", "slsd"), ("bob", ""), ("carol", "slsd,slsd-admin")):
        machine.run("useradd", *(["-G", groups] if groups else []), user)
    status, output = machine.scan()
    require(status == 1 and "calibration" in output, f"a scan without a camera says: {output}")
    machine.run("systemctl", "start", "slsd@example.socket")
    machine.run("slsctl", "--socket", "/run/slsd/example.sock", "scan", "-o", "/tmp/cloud.ply", user="alice")
    return f"active at once; says what is missing; {time.monotonic() - begin:.1f} s from the packages to a cloud of the recorded frame"


def few_rights(machine):
    require(machine.scan()[0] == 0, "a member of slsd cannot scan")
    process = machine.show("slsd.service", "MainPID")
    status = machine.read(f"/proc/{process}/status")
    require(field_of(status, "Uid").split()[0] == machine.run("id", "-u", "slsd")[1].strip(), "it does not run as slsd")
    effective, bound = (int(field_of(status, name), 16) for name in ("CapEff", "CapBnd"))
    require(effective == 1 << 13 == bound, f"capabilities {effective:x}, not CAP_NET_RAW alone")
    require(field_of(status, "NoNewPrivs") == "1" and field_of(status, "Seccomp") == "2", "it may get rights that it has not")
    return "as the user slsd, with CAP_NET_RAW alone, and scans"


def who_may_what(machine):
    status, output = machine.scan(user="bob", output="/tmp/bob.ply")
    require(status == 3 or "group" in output, f"a stranger is told: {output}")
    require(status != 0, "a stranger scans")
    status, output = machine.run("slsctl", "project", "white", user="alice", check=False)
    require(status == 1 and "slsd-admin" in output, f"a member of slsd who may not project is told: {output}")
    machine.run("slsctl", "pattern", "/tmp/mine.png", user="carol")
    machine.run("slsctl", "project", "/tmp/mine.png", user="carol")  # by slsd-picture, within the unit's own walls
    machine.run("slsctl", "project", "idle", user="carol")
    return "slsd scans, slsd-admin projects, a stranger does not get in; each is told which group"


def killed(machine):
    before = machine.show("slsd.service", "MainPID")
    machine.run("kill", "-9", before)
    begin = time.monotonic()
    status, output = machine.scan()  # waits at the socket
    took = time.monotonic() - begin
    require(status == 0, f"the scan after kill -9: {output}")
    require(machine.show("slsd.service", "MainPID") != before, "it was not killed")
    require(took < 10 * machine.slow, f"{took:.1f} s to the next cloud")
    return f"kill -9: who connects meanwhile waits, and has a cloud after {took:.1f} s"


LOOKS_FOR_A_BOARD = """
import json, socket, time
client = socket.socket(socket.AF_UNIX)
client.connect("/run/slsd/slsd.sock")
lines = client.makefile("rwb")
def call(**params):
    lines.write(json.dumps({"jsonrpc": "2.0", "id": 1, "method": "calibrate", "params": params}).encode() + b"\\n")
    lines.flush()
    return json.loads(lines.readline())
told = call(action="begin", board="charuco:11x7:23:17.25:DICT_5X5_1000")
end = time.monotonic() + 100
while "error" not in told and told["result"]["under_way"] and told["result"]["progress"]["state"] == "starting" and time.monotonic() < end:
    time.sleep(0.2)
    told = call()
call(action="cancel")
print(json.dumps(told))
"""


def calibration(machine):
    told = json.loads(machine.run("python3", "-c", LOOKS_FOR_A_BOARD, user="carol")[1])
    require("result" in told and told["result"]["error"] is None, f"a calibration over the socket: {told}")
    state = told["result"]["progress"]["state"]
    require(state in ("no board", "moving", "still", "hold"), f"a calibration over the socket comes to: {told}")
    wait_for(lambda: machine.scan()[0] == 0, "a scan after it was cancelled")
    return f"slsd-calibrate starts with the service's few rights and looks at the camera ({state})"


def frozen(machine):
    before = machine.show("slsd.service", "MainPID")
    watchdog_s = int(machine.show("slsd.service", "WatchdogUSec").removesuffix("s"))
    machine.run("kill", "-STOP", before)
    begin = time.monotonic()
    wait_for(lambda: machine.show("slsd.service", "MainPID") not in ("0", before), "the watchdog", watchdog_s + 20 * machine.slow, 1)
    status, output = machine.scan()
    require(status == 0, f"the scan after SIGSTOP: {output}")
    return f"SIGSTOP: the watchdog ends it, and the next cloud comes after {time.monotonic() - begin:.0f} s"


def wrong_configuration(machine):
    good = machine.example()
    machine.configure(good + "whistle = 3\n")
    status, _ = machine.run("systemctl", "reload", "slsd", check=False)
    require(status != 0, "a reload with a wrong configuration succeeds")
    require(machine.scan()[0] == 0, "a refused reload stops the scanner")
    machine.run("systemctl", "restart", "slsd", check=False)
    wait_for(lambda: machine.show("slsd.service", "ActiveState") == "failed", "the refused start")
    require(machine.show("slsd.service", "ExecMainStatus") == "78", "exit status")
    time.sleep(5 * min(machine.slow, 3))
    require(machine.show("slsd.service", "ActiveState") == "failed", "it is tried again though nobody has corrected it")
    output = machine.run("systemctl", "status", "slsd", check=False)[1]
    require("whistle" in output and "another version" in output, f"the status names no key: {output}")
    machine.set_up()
    require(machine.scan()[0] == 0, "it does not come back")
    return "a key of another version is named; a reload is refused; a start is not tried again until somebody corrects it"


def upgrade(machine):
    machine.write(CALIBRATION, "mine\n")
    before = machine.show("slsd.service", "MainPID")
    machine.run("rm", "-f", "/tmp/enough")
    scans = machine.start("sh", "-c", "while [ ! -e /tmp/enough ]; do slsctl scan -o /tmp/u.ply || exit 1; echo scanned; done", user="alice")
    for version in ("next", "this"):
        machine.shell(f"dpkg --force-confold --force-downgrade -i /packages/{version}/*.deb")
        require(machine.is_active("slsd.service"), f"not active after {version}")
        after = machine.show("slsd.service", "MainPID")
        require(after != before, "an upgrade goes on with the old program")
        before = after
    machine.run("touch", "/tmp/enough")
    status, output = scans.finish(60 * machine.slow)
    require(status == 0, f"a scan beside an upgrade: {output[-500:]}")
    require(machine.read(CALIBRATION) == "mine\n", "the calibration is gone")
    return f"upgrade and downgrade keep everything; {output.count('scanned')} scans beside them, none failed"


def reboot(machine):
    if not machine.has_drivers:
        return None
    machine.write(CALIBRATION, "mine\n")
    begin = time.monotonic()
    machine.reboot()
    took = time.monotonic() - begin
    require(machine.is_active("slsd.service"), "not active after a boot")
    status, output = machine.scan()
    require(status == 0, f"the scan after a boot: {output}")
    require(machine.read(CALIBRATION) == "mine\n", "the calibration is gone")
    return f"a boot: active, and scans, {took:.0f} s after it was asked for; the calibration is there"


def at_rest(machine):
    machine.scan()
    time.sleep(2)
    before = len(machine.journal().splitlines())
    time.sleep(20)
    lines = machine.journal().splitlines()[before:]
    process = machine.show("slsd.service", "MainPID")
    resident_mib = int(field_of(machine.read(f"/proc/{process}/status"), "VmRSS").split()[0]) / 1024
    maps = machine.read(f"/proc/{process}/maps")
    libraries = {line.split()[-1] for line in maps.splitlines() if re.search(r"\.so[.0-9]*$", line)}
    require(not lines, f"lines in the journal within 20 s at rest: {lines}")
    require(resident_mib <= 64, f"{resident_mib:.0f} MiB resident at rest")
    require(len(libraries) <= 60, f"{len(libraries)} libraries")
    return f"at rest: no line in the journal in 20 s, {resident_mib:.0f} MiB resident, {len(libraries)} libraries"


def removed(machine):
    machine.write(CALIBRATION, "mine\n")
    machine.run("dpkg", "--remove", *lifecycle.NAMES)
    require(not machine.is_active("slsd.service"), "removed, and still active")
    require(machine.exists(CALIBRATION), "a removal takes the calibration away")
    machine.run("dpkg", "--purge", *lifecycle.NAMES)
    for user in ("alice", "bob", "carol"):
        machine.run("userdel", user)
    left = [path for path in ("/etc/slsd", "/var/lib/slsd", "/run/slsd", "/usr/bin/slsd") if machine.exists(path)]
    groups = machine.read("/etc/group")
    left += [name for name in ("slsd", "slsd-admin") if re.search(rf"(?m)^{name}:", groups)]
    left += machine.shell("find /etc/systemd /var/lib/systemd/deb-systemd-helper-enabled -name 'slsd*'")[1].split()
    require(not left, f"a purge leaves {left}")
    return "removal stops it and keeps the state; a purge leaves no file, user or group"
