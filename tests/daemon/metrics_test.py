#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The view inside: metrics as parsers that share no code with slsd read them, slsctl top, and the journal's catalogue."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from client import RpcError
from service import SCENE, Service, slsctl, wait_until

sys.path.append("/usr/lib/python3/dist-packages")  # Debian's package, for whichever Python runs this
from prometheus_client.openmetrics.parser import text_string_to_metric_families as read_openmetrics
from prometheus_client.parser import text_string_to_metric_families as read_prometheus

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def samples_of(families):
    return {(sample.name, *sorted(sample.labels.items())): sample.value for family in families for sample in family.samples}


class Metrics:
    """One look, as OpenMetrics."""

    def __init__(self, text, read=read_openmetrics):
        self.families = {family.name: family for family in read(text)}
        self.samples = samples_of(self.families.values())

    def value(self, name, **labels):
        return self.samples[(name, *sorted(labels.items()))]

    def sum(self, name):
        return sum(value for (sample, *_), value in self.samples.items() if sample == name)


def look(client):
    result, payload = client.call("metrics")
    assert result["format"] == "openmetrics"
    return Metrics(payload.decode())


class View(unittest.TestCase):
    def test_counts_what_the_replies_told(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            before = look(client)
            self.assertEqual(before.value("slsd_scans_succeeded_total"), 0)
            replies = [client.call("scan")[0] for _ in range(3)]
            dense = client.call("scan", density="pixels", timeout_ms=600000)[0]
            with self.assertRaises(RpcError):
                client.call("scan", camera="nobody")
            with self.assertRaises(RpcError):
                client.call("scan", colour=1)
            now = look(client)
        replies.append(dense)
        self.assertEqual(now.value("slsd_ready"), 1)
        self.assertEqual(now.value("slsd_scans_succeeded_total"), 4)
        self.assertEqual(now.value("slsd_scans_failed_total", error="not_found"), 1)
        self.assertEqual(now.value("slsd_requests_total", method="scan"), 6)
        self.assertEqual(now.value("slsd_requests_failed_total", error="invalid_params"), 1)
        for status in replies[0]["regions"]:
            self.assertEqual(now.value("slsd_regions_total", status=status), sum(r["regions"][status] for r in replies))
        for rule in set().union(*(r["rules"] for r in replies)):
            counted = [sample for sample in now.samples if sample[0] == "slsd_regions_by_rule_total" and ("rule", rule) in sample]
            self.assertEqual(len(counted), 1, rule)
            self.assertEqual(now.samples[counted[0]], sum(r["rules"].get(rule, 0) for r in replies))
        for status, count in dense["pixels"].items():
            self.assertEqual(now.value("slsd_pixels_total", status=status), count)
        for figure, value in dense["light"]["camera"].items():
            self.assertAlmostEqual(now.value(f"slsd_camera_{figure}", camera="camera"), value, 4)
        self.assertEqual(len(dense["light"]["camera"]), 2)
        self.assertEqual(now.value("slsd_camera_frames_total", camera="camera"), 4)
        self.assertEqual(now.value("slsd_decode_seconds_count"), 4)
        self.assertAlmostEqual(now.value("slsd_decode_seconds_sum"), sum(r["decode_ms"] for r in replies) / 1000, 5)
        self.assertAlmostEqual(now.value("slsd_dense_seconds_sum"), dense["dense_ms"] / 1000, 5)
        for stage, milliseconds in replies[0]["stages_ms"].items():
            self.assertEqual(now.value("slsd_stage_seconds_count", stage=stage), 4)
            within = now.value("slsd_stage_seconds_bucket", stage=stage, le="5.0")
            self.assertEqual(within, 4 if milliseconds < 5000 else within)
        self.assertGreater(now.value("slsd_sent_bytes_total"), sum(r["bytes"] for r in replies))
        self.assertGreater(now.value("slsd_received_bytes_total"), before.value("slsd_received_bytes_total"))
        for name, family in now.families.items():
            self.assertTrue(name.startswith("slsd_"), name)
            self.assertTrue(family.documentation.endswith("."), family.documentation)
            if family.type in ("counter", "histogram"):
                for key, value in before.samples.items():
                    if key[0].startswith(name):
                        self.assertGreaterEqual(now.samples[key], value, key)

    def test_histograms_have_each_scan_in_the_bucket_of_its_time(self):
        with Service() as service, service.client() as client:
            times = [client.call("scan")[0]["decode_ms"] / 1000 for _ in range(5)]
            now = look(client)
        bounds = [float(dict(labels)["le"]) for name, *labels in now.samples if name == "slsd_decode_seconds_bucket"]
        self.assertGreater(len(bounds), 10)
        for bound in bounds:
            label = "+Inf" if bound == float("inf") else repr(bound)
            self.assertEqual(now.value("slsd_decode_seconds_bucket", le=label), sum(t <= bound for t in times), bound)

    def test_lost_frames_have_their_causes_and_openings_are_counted(self):
        with Service(camera='faults = ["drop@2", "tear@3", "disconnect@5"]') as service, service.client() as client:
            for _ in range(2):
                client.call("scan")  # the second takes its frame three times
            with self.assertRaises(RpcError):
                client.call("scan")
            client.call("scan")
            now = look(client)
        for cause, count in {"frame_dropped": 1, "frame_torn": 1, "disconnected": 1, "missing": 0}.items():
            self.assertEqual(now.value("slsd_camera_frames_lost_total", camera="camera", cause=cause), count, cause)
        self.assertEqual(now.value("slsd_camera_reconnects_total", camera="camera"), 1)
        self.assertEqual(now.value("slsd_scan_tries_lost_total"), 2)
        self.assertEqual(now.value("slsd_camera_state", camera="camera", state="ready"), 1)
        self.assertEqual(now.sum("slsd_camera_state"), 1)

    def test_a_subscriber_that_reads_nothing_loses_clouds_that_are_counted(self):
        with Service() as service, service.client() as idler, service.client() as client:
            idler.call("subscribe", density="pixels")
            wait_until(lambda: look(client).value("slsd_clouds_lost_total") > 3, "clouds that are lost")
            self.assertEqual(look(client).value("slsd_subscribers"), 1)

    def test_any_name_of_a_camera_is_a_label(self):
        name = 'left "A" \\ ü 秒'
        calibration = (SCENE / "calibration.yml").read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "calibration.yml")
            file.write_text(calibration, encoding="utf-8")
            with Service(configuration=f'[[camera]]\nname = {json.dumps(name, ensure_ascii=False)}\ndriver = "file"\n'
                                       f'path = "{SCENE}/frame.png"\n[server]\nsocket = "slsd.sock"\n') as service:
                with service.client() as client:
                    self.assertEqual(look(client).sum("slsd_camera_state"), 1)
                    self.assertEqual(look(client).value("slsd_camera_frames_total", camera=name), 0)
                self.assertIn("frames/s", slsctl("--socket", service.socket, "top", "--count", 1).stdout)


class OlderFormat(unittest.TestCase):
    """Of Prometheus, 0.0.4, which node_exporter reads."""

    def test_has_the_same_samples_with_type_and_help(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            client.call("scan", timeout_ms=600000)
            told, payload = client.call("metrics", format="prometheus")
            newer = look(client)
            with self.assertRaisesRegex(RpcError, "openmetrics"):
                client.call("metrics", format="xml")
        self.assertEqual(told["format"], "prometheus")
        text = payload.decode()
        older = Metrics(text, read_prometheus)
        self.assertEqual(older.samples.keys(), newer.samples.keys())
        self.assertEqual(older.value("slsd_scans_succeeded_total"), 1)
        typed = dict(re.findall(r"^# TYPE (\S+) (\S+)$", text, re.M))
        helped = dict(re.findall(r"^# HELP (\S+) (.+)$", text, re.M))
        self.assertEqual(typed.keys(), helped.keys())
        for name, *_ in older.samples:
            whole = name if name in typed else re.sub(r"_(bucket|sum|count)$", "", name)
            self.assertEqual(typed[whole], "counter" if name.endswith("_total") else "histogram" if whole != name else "gauge", name)
        for name, family in newer.families.items():
            self.assertEqual(helped[name + "_total" if family.type == "counter" else name], family.documentation)
        self.assertNotIn("# UNIT", text)
        self.assertNotIn("# EOF", text)
        self.assertTrue(text.endswith("\n"))


class Programs(unittest.TestCase):
    def test_slsctl_prints_them_and_writes_them_whole(self):
        with Service() as service, tempfile.TemporaryDirectory() as folder:
            printed = slsctl("--socket", service.socket, "metrics")
            self.assertEqual((printed.returncode, printed.stderr), (0, ""))
            Metrics(printed.stdout)
            file = pathlib.Path(folder, "slsd.prom")
            for _ in range(2):
                written = slsctl("--socket", service.socket, "metrics", "--output", file)
                self.assertEqual((written.returncode, written.stdout + written.stderr), (0, ""))
                self.assertIn("# TYPE slsd_scans_succeeded_total counter\n", file.read_text(encoding="utf-8"))
                Metrics(file.read_text(encoding="utf-8"), read_prometheus)
            slsctl("--socket", service.socket, "metrics", "--output", file, "--format", "openmetrics")
            Metrics(file.read_text(encoding="utf-8"))
            older = slsctl("--socket", service.socket, "metrics", "--format", "prometheus").stdout
            self.assertIn("# HELP slsd_scans_succeeded_total Scans that gave a cloud.\n", older)
            self.assertEqual([entry.name for entry in pathlib.Path(folder).iterdir()], ["slsd.prom"])
            refused = slsctl("--socket", service.socket, "metrics", "-o", pathlib.Path(folder, "no/where.prom"))
            self.assertEqual(refused.returncode, 1)
            self.assertIn("no/where.prom", refused.stderr)
        self.assertEqual(slsctl("--socket", service.socket, "metrics").returncode, 3)

    def test_top_tells_the_rates_of_each_interval(self):
        with Service() as service, service.client() as client:
            client.call("subscribe", rate_hz=20)
            for _ in range(3):
                client.receive()
            top = slsctl("--socket", service.socket, "--json", "top", "--count", 3, "--interval", 1)
            self.assertEqual((top.returncode, top.stderr), (0, ""))
            looks = [json.loads(line) for line in top.stdout.splitlines()]
            self.assertEqual(len(looks), 3)
            for each in looks[1:]:
                self.assertGreater(each["scans_hz"], 1)
                self.assertLess(each["scans_hz"], 25)
                self.assertLess(each["seconds"], 5)
                self.assertGreater(each["decode_ms"]["most"], 0)
                self.assertGreaterEqual(each["decode_ms"]["most"], each["decode_ms"]["half"])
            shown = slsctl("--socket", service.socket, "top", "--count", 1).stdout
            for word in ("ready to scan", "decode", "binarize", "decoded", "camera", "regions"):
                self.assertIn(word, shown)
            self.assertNotIn("\x1b", shown)


class Catalogue(unittest.TestCase):
    FILE = SOURCE / "systemd/slsd.catalog"

    def test_explains_each_id_of_the_log(self):
        ids = re.findall(r'= "([0-9a-f]{32})"', (SOURCE / "daemon/scan/message_ids.hpp").read_text(encoding="utf-8"))
        explained = re.findall(r"^-- ([0-9a-f]{32})$", self.FILE.read_text(encoding="utf-8"), re.M)
        self.assertEqual(sorted(ids), sorted(explained))
        self.assertEqual(len(set(ids)), len(ids))

    def test_names_the_remedy_of_a_knock(self):
        knock = re.search(r'kKnocked = "([0-9a-f]{32})"', (SOURCE / "daemon/scan/message_ids.hpp").read_text(encoding="utf-8"))[1]
        entry = self.FILE.read_text(encoding="utf-8").split(f"-- {knock}")[1].split("\n-- ")[0]
        self.assertIn("\n    slsd --correct\n", entry)

    def test_is_read_by_journalctl(self):
        if not shutil.which("journalctl"):
            self.skipTest("no journalctl here (package systemd)")
        with tempfile.TemporaryDirectory() as folder:
            catalogue = pathlib.Path(folder, "usr/lib/systemd/catalog")
            catalogue.mkdir(parents=True)
            shutil.copy(self.FILE, catalogue)
            pathlib.Path(folder, "var/lib/systemd/catalog").mkdir(parents=True)
            subprocess.run(["journalctl", f"--root={folder}", "--update-catalog"], check=True, capture_output=True)
            listed = subprocess.run(["journalctl", f"--root={folder}", "--list-catalog"], check=True,
                                    capture_output=True, text=True).stdout
        self.assertEqual(len(listed.splitlines()), self.FILE.read_text(encoding="utf-8").count("\n-- "))


if __name__ == "__main__":
    unittest.main(verbosity=2)
