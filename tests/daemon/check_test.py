#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""slsd --check: what it finds, alone and beside a running service."""
import pathlib
import re
import shutil
import signal
import tempfile
import unittest

from clipped_frame import write_clipped
from service import SCENE, Service, slsd, wait_until

# --check measures dense clouds too: where a test looks at something else, in a third of the time.
COARSE = "\n[decode]\ndense_stride_px = 8\n"


class Check(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(self.temporary.cleanup)
        self.folder = pathlib.Path(self.temporary.name)
        self.file = self.folder / "slsd.toml"

    def test_check_finds_what_forbids_a_scan(self):
        service = Service(camera_path=SCENE / "small.png", camera=COARSE)
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertIn("640x480 px, but its calibration is for 1600x1200 px", result.stdout)
        service = Service(camera=COARSE)
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 0, result.stdout)

    def checked_with(self, change, decode=""):
        """What --check says with another calibration."""
        service = Service()
        text = change((SCENE / "calibration.yml").read_text(encoding="utf-8"))
        (service.folder / "other.yml").write_text(text, encoding="utf-8")
        configuration = service.file.read_text(encoding="utf-8")
        service.file.write_text(configuration.replace(f"{SCENE}/calibration.yml", "other.yml") + decode, encoding="utf-8")
        return slsd("--check", "--config", service.file).stdout

    def test_check_says_what_dense_clouds_would_give(self):
        said = self.checked_with(lambda text: text)
        self.assertRegex(said, r'ok +dense clouds of camera "camera", at 1000 mm: resolves parts from \d+\.\d mm, and half the height '
                               r'of waves \d+\.\d mm long; .* points of 1920000 pixels in \d+ ms per frame, in \d+ ms .* still scene. Memory: \d+ MB')
        self.assertNotIn("dense_stride_px", said)
        self.assertNotIn("calibrate again", said)

    def test_check_warns_of_a_calibration_that_is_far_off(self):
        said = self.checked_with(lambda text: text + "\nreprojection_error_projector_px: 0.62\n", COARSE)
        self.assertIn("warning  the calibration's reprojection error in the projector is 0.62 px", said)

    def test_check_warns_of_a_pattern_that_is_too_coarse(self):
        def nearer(text):
            matrix = re.search(r"camera_matrix:.*?data: \[(.*?)\]", text, re.S).group(1)
            values = [float(value) for value in matrix.split(",")]
            values[0], values[4] = 3 * values[0], 3 * values[4]
            return text.replace(matrix, ", ".join(map(repr, values)))
        self.assertIn("the pattern is too coarse for this camera", self.checked_with(nearer, COARSE))

    def test_check_names_the_stride_that_memory_allows(self):
        larger = lambda text: text.replace("width: 1600", "width: 3200", 1)
        said = self.checked_with(larger, "\n[decode]\ndense_stride_px = 1\n")
        self.assertIn("dense_stride_px = 1 would need too much memory", said)

    def test_warns_of_symbols_that_look_alike(self):
        self.file.write_text("[pattern]\nsymbol_size_px = 8\nsymbols = [1, 7, 22, 25]\n", encoding="utf-8")
        self.assertIn("warning  symbol", slsd("--check", "--config", self.file).stdout)

    def test_check_compares_latency_and_exposure_with_the_configuration(self):
        service = Service(camera=COARSE)
        latency = "[[camera]]\nname = 'camera'\nflashes = 20\nlatency_us = 51234\n"
        text = service.file.read_text(encoding="utf-8").replace(f"{SCENE}/calibration.yml", "calibration.yml")
        service.file.write_text(text, encoding="utf-8")
        shutil.copy(SCENE / "calibration.yml", service.folder)
        (service.folder / "latency.toml").write_text(latency, encoding="utf-8")
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn("warning  camera \"camera\" saw complete images only 51.2 ms", result.stdout)
        self.assertIn("set 52", result.stdout)
        (service.folder / "latency.toml").write_text("latency = 1\n", encoding="utf-8")
        self.assertEqual(slsd("--check", "--config", service.file).returncode, 1)
        self.file.write_text("[[camera]]\ndriver = 'v4l2'\ndevice = '/nothing'\nexposure_us = 20000\n", encoding="utf-8")
        self.assertIn("set 16667 or 33333", slsd("--check", "--config", self.file).stdout)

    def test_check_names_the_troubles_of_the_light(self):
        troubled = Service(camera_path=write_clipped(self.folder / "clipped.pgm"), camera=COARSE)
        self.assertIn('warning  camera "camera": clipped: symbols are clipped', slsd("--check", "--config", troubled.file).stdout)
        self.assertNotRegex(slsd("--check", "--config", Service(camera=COARSE).file).stdout, "clipped|blurred|ambient|no_pattern")

    def test_check_of_a_running_service_is_no_error(self):
        with Service(camera=COARSE) as service:
            service.wait_ready()
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertIn('ok       camera "camera": in use by the service, ready', result.stdout)
            self.assertIn("ok       projector: in use by the service, ready", result.stdout)
            self.assertNotIn("opens", result.stdout)
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text + "clients_max = 7\n", encoding="utf-8")
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertIn("warning  service: [server] differs from this file", result.stdout)

    def test_check_asks_the_service_of_a_camera_that_it_has_lost(self):
        folder = self.folder / "frames"
        folder.mkdir()
        shutil.copy(SCENE / "frame.png", folder)
        with Service(camera_path=folder, camera=COARSE) as service:
            service.wait_ready()
            shutil.rmtree(folder)
            with service.client() as client:
                wait_until(lambda: client.call("status")[0]["cameras"][0]["state"] == "absent", "the loss")
            result = slsd("--check", "--config", service.file)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertRegex(result.stdout, 'error    camera "camera": the service reports it as absent: .*frames')

    def test_check_names_the_configuration_of_another_service(self):
        with Service(camera=COARSE) as service:
            other = service.folder / "other.toml"
            shutil.copy(service.file, other)
            result = slsd("--check", "--config", other)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn(f"the service at this socket has another configuration, {service.file}", result.stdout)
            self.assertIn('ok       camera "camera" opens', result.stdout)

    def test_check_leaves_the_devices_of_a_service_that_hangs_alone(self):
        with Service(camera=COARSE) as service:
            service.wait_ready()
            service.send_signal(signal.SIGSTOP)
            result = slsd("--check", "--config", service.file)
            service.send_signal(signal.SIGCONT)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn("the service does not answer", result.stdout)
            self.assertNotIn("opens", result.stdout)

    def test_check_names_cameras_to_choose_for_one_that_is_absent(self):
        service = Service(configuration='[[camera]]\ndriver = "v4l2"\ndevice = "/dev/no-such-camera"\n')
        result = slsd("--check", "--config", service.file)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stdout, "(?s)no-such-camera.*No such file.*(found with this driver|no other camera of this driver)")


if __name__ == "__main__":
    unittest.main(verbosity=2)
