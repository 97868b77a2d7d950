# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Several scanners on one host, by slsd@NAME and slsd-dds@NAME, through upgrades, removals and purges of the packages."""
from machine import require, wait_for

ENABLED = ("slsd@left.socket", "slsd@left.service", "slsd-dds@left.service")  # by the administrator, to start at boot
STARTED = ("slsd@example.socket", "slsd@example.service")
SERVICES = tuple(unit for unit in ENABLED + STARTED if unit.endswith(".service"))


def set_up(machine):
    left = machine.read("/etc/slsd/example.toml").replace("/run/slsd/example.sock", "/run/slsd/left.sock")
    machine.write("/etc/slsd/left.toml", left)
    machine.run("systemctl", "enable", "-q", "--now", *ENABLED)
    machine.run("systemctl", "start", *STARTED)


def processes(machine):
    return {unit: machine.show(unit, "MainPID") for unit in SERVICES}


def programs(machine):
    """The processes that run a program of ours, deleted or not."""
    return machine.shell("ls -l /proc/[0-9]*/exe 2>/dev/null | grep '/usr/.*/slsd' || true")[1].strip()


def require_scans(machine, *names):
    for name in names:
        machine.run("slsctl", "--socket", f"/run/slsd/{name}.sock", "scan", "-o", "/tmp/cloud.ply")


def upgraded(machine, install):
    before = processes(machine)
    install()
    after = processes(machine)
    for unit in SERVICES:
        require(after[unit] not in ("0", before[unit]), f"an upgrade goes on with the old program of {unit}")
    require("(deleted)" not in programs(machine), f"after an upgrade a deleted program runs: {programs(machine)}")
    require_scans(machine, "left", "example")


def removed(machine, names, install):
    machine.run("dpkg", "--remove", *names)
    require(not programs(machine), f"after a removal there runs: {programs(machine)}")
    install()
    for unit in ENABLED:
        wait_for(lambda unit=unit: machine.is_active(unit), f"{unit}, which is enabled, after the packages are back")
    require_scans(machine, "left")
    machine.run("systemctl", "start", *STARTED)


def purged(machine, names):
    machine.run("dpkg", "--purge", *names)
    require(not programs(machine), f"after a purge there runs: {programs(machine)}")
    require(not machine.shell("grep -E '^slsd' /etc/passwd /etc/group || true")[1], "a purge leaves the user or a group")
    left = machine.shell("find /etc/systemd /etc/slsd /run/slsd -name 'slsd*' -o -name '*.sock' 2>/dev/null || true")[1].split()
    require(not left, f"a purge leaves {left}")


def live_with_instances(machine, random, rounds, names):
    """Any order of what an administrator does. @return how often each was done"""
    def install(version):
        machine.shell(f"dpkg --force-unsafe-io --force-confold --force-downgrade -i /packages/{version}/*.deb")

    machine.look_how_slow()
    install("this")
    set_up(machine)
    version, done = "this", {}
    for number in range(rounds):
        what = ("upgrade", "remove", "purge")[number] if number < 3 else random.choice(("upgrade", "remove", "purge"))
        done[what] = done.get(what, 0) + 1
        version = "next" if version == "this" else "this"
        if what == "upgrade":
            upgraded(machine, lambda: install(version))
        elif what == "remove":
            removed(machine, names, lambda: install(version))
        else:
            purged(machine, names)
            install(version)
            set_up(machine)
    purged(machine, names)
    return done
