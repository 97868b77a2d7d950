#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The dashboard and the alerts: each metric and label that they use is one that the service tells."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

from service import Service

sys.path.append("/usr/lib/python3/dist-packages")  # Debian's package, for whichever Python runs this
import yaml  # noqa: E402

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ALERTS, DASHBOARD = (SOURCE / "config/monitoring" / name for name in ("slsd-alerts.yml", "slsd-dashboard.json"))
OF_PROMETHEUS = {"instance", "job", "le"}


def alerts():
    return [rule for group in yaml.safe_load(ALERTS.read_text(encoding="utf-8"))["groups"] for rule in group["rules"]]


def panels():
    return json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]


def expressions():
    return [rule["expr"] for rule in alerts()] + [target["expr"] for panel in panels() for target in panel["targets"]]


def documented_labels():
    """The labels of each metric, by docs/metrics.md."""
    labels = {}
    for line in (SOURCE / "docs/metrics.md").read_text(encoding="utf-8").splitlines():
        cells = line.split("|")
        for name in re.findall(r"`(slsd_\w+)`", cells[1]) if len(cells) == 5 else []:
            labels[name] = set(re.findall(r"`(\w+)`", cells[2]))
    return labels


class Monitoring(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with Service() as service, service.client() as client:
            service.wait_ready()
            cls.text = client.call("metrics", format="prometheus")[1].decode()
        cls.types = dict(re.findall(r"^# TYPE (\S+) (\S+)$", cls.text, re.M))

    def type_of(self, series):
        whole = re.sub(r"_(bucket|sum|count)$", "", series)
        return "histogram" if self.types.get(whole) == "histogram" and whole != series else self.types.get(series)

    def test_uses_metrics_that_are_told(self):
        used = {name for each in expressions() for name in re.findall(r"\bslsd_\w+", each)}
        self.assertGreater(len(used), 30)
        for name in used:
            self.assertIn(self.type_of(name), ("counter", "gauge", "histogram"), name)

    def test_takes_rates_of_what_only_grows(self):
        rated = [name for each in expressions() for name in re.findall(r"(?:rate|increase)\((slsd_\w+)", each)]
        for name in rated:
            self.assertIn(self.type_of(name), ("counter", "histogram"), name)
        bare = {name for each in expressions() for name in re.findall(r"(?<!rate\()(?<!increase\()\b(slsd_\w+)", each)}
        for name in bare:
            self.assertEqual(self.type_of(name), "gauge", name)

    def test_uses_labels_that_are_told(self):
        known = documented_labels()
        self.assertGreater(len(known), 40)
        for each in expressions():
            used = {label for part in re.findall(r"(?:by|ignoring|on|without) \(([^)]*)\)", each) for label in re.split(r", *", part)}
            of_all = set()
            for name, matchers in re.findall(r"\b(slsd_\w+)(?:\{([^}]*)\})?", each):
                labels = known.get(name, known.get(re.sub(r"_(bucket|sum|count)$", "", name)))
                self.assertIsNotNone(labels, name)
                self.assertLessEqual(set(re.findall(r"(\w+)=", matchers)) - OF_PROMETHEUS, labels, each)
                of_all |= labels
            self.assertLessEqual(used - OF_PROMETHEUS, of_all, each)

    def test_names_states_and_parts_that_there_are(self):
        for label in ("state", "part"):
            there = set(re.findall(rf'{label}="(\w+)"', self.text))
            named = {word for each in expressions() for words in re.findall(rf'{label}=~?"([\w|]+)"', each) for word in words.split("|")}
            self.assertTrue(named)
            self.assertLessEqual(named, there)

    def test_each_alert_says_what_to_do(self):
        names = [rule["alert"] for rule in alerts()]
        self.assertEqual(len(set(names)), len(names))
        about = (SOURCE / "docs/metrics.md").read_text(encoding="utf-8")
        for rule in alerts():
            self.assertIn(rule["labels"]["severity"], ("critical", "warning", "info"))
            self.assertGreater(len(rule["annotations"]["description"]), 20)
            self.assertIn(f"`{rule['alert']}`", about)
            of_alert = re.findall(r"\$labels\.(\w+)", rule["annotations"]["summary"])
            known = {label for name in re.findall(r"slsd_\w+", rule["expr"]) for label in documented_labels()[name]}
            self.assertLessEqual(set(of_alert) - OF_PROMETHEUS, known, rule["alert"])

    def test_the_alert_of_a_knock_names_the_remedy(self):
        knocked = next(rule for rule in alerts() if rule["alert"] == "SlsdCameraKnocked")
        self.assertIn("`slsd --correct`", knocked["annotations"]["description"])

    def test_the_panels_lie_beside_each_other(self):
        taken = set()
        for panel in panels():
            at = panel["gridPos"]
            self.assertLessEqual(at["x"] + at["w"], 24)
            cells = {(x, y) for x in range(at["x"], at["x"] + at["w"]) for y in range(at["y"], at["y"] + at["h"])}
            self.assertFalse(taken & cells, panel["title"])
            taken |= cells
        self.assertEqual(len({panel["id"] for panel in panels()}), len(panels()))

    def test_prometheus_own_tool_takes_all(self):
        tool = shutil.which("promtool")
        if not tool:
            self.skipTest("promtool is not installed (apt install prometheus)")
        rules = subprocess.run([tool, "check", "rules", ALERTS], capture_output=True, text=True, check=False)
        self.assertEqual(rules.returncode, 0, rules.stderr)
        metrics = subprocess.run([tool, "check", "metrics"], input=self.text, capture_output=True, text=True, check=False)
        self.assertNotEqual(metrics.returncode, 1, metrics.stderr)  # 3: lint, as of "_px"
        self.assertNotIn("error while linting", metrics.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
