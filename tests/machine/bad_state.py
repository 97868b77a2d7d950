# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What an administrator's machine may do to the service: each is one error with a name, and what was there stays."""
import contextlib

from installation import CALIBRATION
from machine import require, wait_for

STATE = "/var/lib/slsd"


@contextlib.contextmanager
def small_disk(machine, folder, spare_kb):
    """The folder with what is in it on a disk of its own, on which so much is left."""
    machine.shell(f"set -e; rm -rf /run/copy; cp -a {folder} /run/copy; size=$(du -sk {folder} | cut -f1); "
                  f"mount -t tmpfs -o size=$((size+{spare_kb}))k tmpfs {folder}; cp -a /run/copy/. {folder}/; "
                  f"chown --reference=/run/copy {folder}; chmod --reference=/run/copy {folder}")
    try:
        yield
    finally:
        machine.run("umount", folder)


def still_scans(machine, after):
    status, output = machine.scan()
    require(status == 0, f"after {after} it does not scan: {output}")


def unknown_groups(machine):
    good = machine.example()
    machine.configure(good + 'scan = ["@robots"]\n')
    status, _ = machine.run("systemctl", "reload", "slsd", check=False)
    require(status != 0, "a reload with a group that does not exist succeeds")
    still_scans(machine, "a refused reload")
    machine.run("systemctl", "restart", "slsd", check=False)
    wait_for(lambda: 'names the group "robots", which does not exist on this host' in machine.journal(), "the error that names the group")
    machine.run("groupadd", "robots")
    try:
        wait_for(lambda: machine.is_active("slsd.service"), "the start after groupadd")
        status, output = machine.scan()
        require(status == 1 and "robots" in output, f"who is not in the group is told: {output}")
    finally:
        machine.run("groupdel", "robots")
    machine.set_up()
    # The group of the socket itself, as on a host whose groups come from elsewhere.
    machine.run("groupmod", "-n", "elsewhere", "slsd")
    try:
        status, _ = machine.run("systemctl", "restart", "slsd.socket", check=False)
        require(status != 0, "the socket is made for a group that does not exist")
        require("slsd" in machine.journal("slsd.socket") and "group" in machine.journal("slsd.socket").lower(),
                f"the journal names no group: {machine.journal('slsd.socket')[-300:]}")
    finally:
        machine.run("groupmod", "-n", "slsd", "elsewhere")
    machine.run("systemctl", "reset-failed", "slsd.socket", "slsd.service", check=False)
    machine.run("systemctl", "restart", "slsd.socket")
    machine.set_up()
    still_scans(machine, "the group is back")
    return "groups that do not exist are named; a reload keeps what was; it starts as soon as they are made"


def missing_socket_folder(machine):
    machine.run("rm", "-rf", "/run/slsd")
    machine.run("systemctl", "restart", "slsd.socket", "slsd.service")
    still_scans(machine, "its folder was gone")
    machine.write("/etc/slsd/other.toml", machine.example().replace("/run/slsd/", "/run/nowhere/"))
    status, output = machine.run("slsd", "--config", "/etc/slsd/other.toml", user="slsd", check=False)
    machine.run("rm", "/etc/slsd/other.toml")
    require(status != 0 and "/run/nowhere" in output and "folder" in output, f"status {status}: {output}")
    return "units make the folder of the socket anew; started by hand without it, it says which is missing"


def bad_state_folder(machine):
    told = []
    machine.write(CALIBRATION, "mine\n")
    for what, mend in (("mount --bind {0} {0} && mount -o remount,bind,ro {0}", "umount {0}"),
                       ("chown -R root:root {0} && chmod 700 {0}", "chown -R slsd:slsd {0}; chmod 755 {0}")):
        machine.shell(what.format(STATE))
        try:
            machine.run("systemctl", "restart", "slsd", check=False)
            wait_for(lambda: machine.is_active("slsd.service"), f"a start with {what}")
            still_scans(machine, what)
            told.append(machine.run("slsctl", "set", "decode.depth_max_mm=2400", user="carol", check=False))
        finally:
            machine.shell(mend.format(STATE))
    with small_disk(machine, STATE, 16):
        machine.shell(f"dd if=/dev/zero of={STATE}/ballast bs=1k 2>/dev/null || true")
        machine.run("systemctl", "restart", "slsd", check=False)
        wait_for(lambda: machine.is_active("slsd.service"), "a start with a full state folder")
        still_scans(machine, "its disk is full")
        told.append(machine.run("slsctl", "set", "decode.depth_max_mm=2300", user="carol", check=False))
    require(machine.read(CALIBRATION) == "mine\n", "the calibration is gone")
    machine.run("rm", "-f", CALIBRATION)
    for (_, output), word in zip(told, ("Read-only", "", "No space")):
        require(word in output, f'"{word}" is not in: {output}')
    machine.run("systemctl", "restart", "slsd")
    machine.run("slsctl", "set", "decode.depth_max_mm=default", user="carol")
    return "read-only, another user's or full: it starts and scans, and what it cannot keep it says by name"


def two_versions(machine):
    before = machine.run("dpkg-query", "-W", "slsd", "slsd-client", "slsd-calibrate")[1]
    for package in ("slsd", "slsd-calibrate"):
        status, output = machine.shell(f"dpkg --force-confold -i /packages/next/{package}_*.deb", check=False)
        require(status != 0 and "slsd" in output, f"{package} of another version beside the others is installed: {output[-300:]}")
        machine.shell("dpkg --force-confold --force-downgrade -i /packages/this/*.deb")
        require(machine.run("dpkg-query", "-W", "slsd", "slsd-client", "slsd-calibrate")[1] == before, "not all are of one version again")
    machine.set_up()
    still_scans(machine, "two versions were tried")
    return "dpkg refuses one package of another version and names the other"


def full_disk(machine):
    before = machine.run("dpkg-query", "-W", "slsd")[1]
    config = machine.read("/etc/slsd/slsd.toml")
    with small_disk(machine, "/usr/share/slsd/example", 16):
        status, output = machine.shell("dpkg --force-confold -i /packages/next/slsd*.deb", check=False)
        require(status != 0 and "No space left on device" in output, f"status {status}: {output[-400:]}")
        still_scans(machine, "an upgrade for which the disk was too small")
    require(machine.read("/etc/slsd/slsd.toml") == config, "the configuration is another")
    machine.shell("dpkg --force-confold --force-downgrade -i /packages/this/*.deb")
    require(machine.run("dpkg-query", "-W", "slsd")[1] == before, "the version is another")
    require(not machine.run("dpkg", "--verify", "slsd")[1].replace(" c /etc", "").count("??5??????  /"), "files are changed")
    machine.set_up()
    still_scans(machine, "the disk was full")
    return "a disk that fills while upgrading: dpkg says so, the old program goes on, and the next try installs it"
