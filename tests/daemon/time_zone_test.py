#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Times on machines of other time zones than UTC: whatever ends in Z is UTC."""
import datetime
import json
import pathlib
import re
import subprocess
import tarfile
import tempfile
import unittest

from service import BIN, SCENE, Service, slsctl

# As POSIX writes them, so that no tzdata is needed: Kathmandu, New York, and one west of the date line.
ZONES = ["<+0545>-5:45", "EST5EDT,M3.2.0,M11.1.0", "<-11>11"]
SLACK = datetime.timedelta(seconds=1)


def now():
    return datetime.datetime.now(datetime.timezone.utc)


def read(text, shape="%Y-%m-%dT%H:%M:%S.%fZ"):
    return datetime.datetime.strptime(text, shape).replace(tzinfo=datetime.timezone.utc)


class TimeZone(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.began = now()

    def assert_now(self, time, what):
        self.assertLess(self.began - SLACK, time, what)
        self.assertLess(time, now() + SLACK, what)

    def check(self, service, environment):
        call = lambda *words: slsctl("--socket", service.socket, "--json", *words, env=environment)  # noqa: E731
        told = json.loads(call("scan", "-o", self.folder / "cloud.ply").stdout)
        self.assert_now(read(told["time"]), "the reply of a scan")
        self.assertEqual(round(1000 * read(told["time"]).timestamp()), told["time_ns"] // 1_000_000)
        header = (self.folder / "cloud.ply").read_bytes().split(b"end_header")[0].decode()
        self.assertIn(f"comment time {told['time']}", header)
        call("scan", "-o", self.folder / "cloud.pcd")
        header = (self.folder / "cloud.pcd").read_bytes().split(b"DATA")[0].decode()
        self.assert_now(read(re.search(r"time (\S+Z)", header)[1]), "a PCD file")
        self.check_bundle(service, environment)
        lines = service.log_text().splitlines()
        self.assert_now(read(lines[-1].split()[0]), "the log")

    def check_bundle(self, service, environment):
        done = subprocess.run([BIN / "slsctl", "--socket", service.socket, "bundle"], cwd=self.folder, env=environment,
                              capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        file, = self.folder.glob("*.tar")
        stamp = re.search(r"\d{8}T\d{6}Z|\d{4}-\d\d-\d\dT[\d:-]*Z", file.name)[0]
        self.assert_now(read(re.sub("[-:]", "", stamp), "%Y%m%dT%H%M%SZ"), "the name of a bundle")
        with tarfile.open(file) as archive:
            about = json.load(archive.extractfile("bundle.json"))
            scans = archive.extractfile("recording-1/scans.jsonl").read().decode().splitlines()
        self.assert_now(read(about["written"], "%Y-%m-%dT%H:%M:%SZ"), "bundle.json")
        for line in scans:
            self.assert_now(read(json.loads(line)["time"]), "scans.jsonl")
        file.unlink()

    def test_times_are_utc_in_every_zone(self):
        for zone in ZONES:
            with self.subTest(zone), Service(environment={"TZ": zone}) as service:
                service.wait_ready()
                self.check(service, service.environment)


if __name__ == "__main__":
    unittest.main()
