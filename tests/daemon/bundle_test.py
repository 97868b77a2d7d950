#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The black box: bundles of the last scans, by hand and by the service itself, and their replay."""
import collections
import csv
import io
import json
import os
import pathlib
import shutil
import stat
import subprocess
import tarfile
import tempfile
import unittest

import robot_frame_test as robot_frame
from client import RpcError
from service import BIN, SCENE, Service, slsctl, wait_until

CORPUS = pathlib.Path(__file__).parent.parent / "corpus"
BUST = CORPUS / "16px-5-bust"
DENSE = """
[pattern]
file = "{corpus}/pattern.toml"
[[camera]]
name = "camera"
path = "frames"
{camera}
[calibration]
file = "{corpus}/calibration.yml"
[decode]
depth_min_mm = 1500.0
[scan]
timeout_ms = 60000
reopen_first_ms = 20
reopen_longest_ms = 50
[server]
socket = "slsd.sock"
[black_box]
{black_box}
"""

BOX = [-220.0, -180.0, 1500.0, 190.0, 210.0, 2600.0]  # some of the bust
PLANE = [0.0, 0.0, -1.0, -2300.0]  # what is nearer


def box_in_base(base_from_rig):
    """Some of the bust, in the robot's base."""
    at = base_from_rig[:3, :3] @ [0.0, 0.0, 2000.0] + base_from_rig[:3, 3]
    return [*map(float, at - 180), *map(float, at + 180)]


def replay(bundle, *arguments):
    return subprocess.run([BIN / "slsd", "--replay", bundle, *arguments], capture_output=True, text=True, check=False,
                          timeout=120)


def service_on(scenes, camera="", black_box="", environment=None):
    """A service that sees the scenes in turn."""
    service = Service(configuration=DENSE.format(corpus=BUST, camera=camera, black_box=black_box),
                      environment=environment)
    (service.folder / "frames").mkdir()
    for i, scene in enumerate(scenes):
        shutil.copy(CORPUS / scene / "frame.png", service.folder / "frames" / f"{i}.png")
        for light in ("white", "dark"):
            if (CORPUS / scene / f"{light}.png").exists():
                (service.folder / "frames" / light).mkdir(exist_ok=True)
                shutil.copy(CORPUS / scene / f"{light}.png", service.folder / "frames" / light / f"{i}.png")
    return service


def unpacked(file):
    """Name and bytes of each file, as Python's own reader has them."""
    with tarfile.open(file, "r:") as archive:
        return {member.name: archive.extractfile(member).read() for member in archive.getmembers()}


class Bundle(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.file = self.folder / "bundle.tar"

    def bundle(self, service):
        result = slsctl("--socket", service.socket, "bundle", "-o", self.file)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout.strip(), str(self.file))
        return unpacked(self.file)

    def test_replays_to_the_same_bytes(self):
        with service_on(["16px-5-bust", "16px-5-plane_0"]) as service:
            service.wait_ready()
            with service.client() as client:
                clouds = [client.call("scan", timeout_ms=600000)[1] for _ in range(2)]
                dense = client.call("scan", timeout_ms=600000, density="pixels")[1]
            files = self.bundle(service)
        self.assertEqual([files[f"recording-1/clouds/0000000{i}.ply"] for i in range(2)], clouds)
        told = [json.loads(line) for line in files["recording-1/scans.jsonl"].splitlines()]
        for scan in told:
            reasons = list(csv.DictReader(files["recording-1/" + scan["reasons"]].decode().splitlines()))
            for key, told_counts in (("status", scan["regions"]), ("rule", scan["rules"])):
                counts = collections.Counter(reason[key] for reason in reasons)
                self.assertGreater(len(counts), 1)
                self.assertEqual(counts, {name: told_counts[name] for name in counts})
            self.assertEqual(len(reasons), sum(scan["regions"].values()) - scan["regions"]["decoded"])
        result = replay(self.file, "--unpack", self.folder / "unpacked")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(result.stdout.count("the same cloud, byte for byte"), 3)
        replayed = self.folder / "unpacked" / "recording-1" / "replayed"
        self.assertEqual([(replayed / f"0000000{i}.ply").read_bytes() for i in range(2)], clouds)
        self.assertEqual((replayed / "00000002.dense.ply").read_bytes(), dense)
        self.assertEqual({name for name in files if name.startswith("recording-1/camera")},
                         {f"recording-1/camera/0000000{i}.png" for i in range(3)})
        # As every recording does, it replays through the service, too.
        again = Service(configuration=files["recording-1/slsd.toml"].decode())
        shutil.copytree(self.folder / "unpacked" / "recording-1", again.folder, dirs_exist_ok=True)
        with again, again.client() as client:
            cloud = client.call("scan", timeout_ms=600000)[1]
        self.assertEqual(cloud.split(b"end_header\n", 1)[1], clouds[0].split(b"end_header\n", 1)[1])

    def check_replays_parts(self, table, scans, hand_eye=None):
        """Scans by their parameters: the bundle decodes each to the points that the service gave."""
        service = service_on(["16px-5-bust"])
        service.file.write_text(service.file.read_text(encoding="utf-8") + table, encoding="utf-8")
        if hand_eye:
            (service.folder / "hand_eye.yml").write_text(hand_eye, encoding="utf-8")
        with service:
            service.wait_ready()
            with service.client() as client:
                clouds = [client.call("scan", timeout_ms=600000, **{"coordinate_frame": "rig", **scan})[1] for scan in scans]
            files = self.bundle(service)
        result = replay(self.file, "--unpack", self.folder / "unpacked")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertEqual(result.stdout.count("the same cloud, byte for byte"), len(scans))
        replayed = self.folder / "unpacked" / "recording-1" / "replayed"
        for i, (scan, cloud) in enumerate(zip(scans, clouds)):
            ending = ".dense.ply" if "density" in scan else ".ply"
            self.assertEqual((replayed / f"{i:08}{ending}").read_bytes(), bytes(cloud), scan)
        return clouds, files

    def check_service_replays(self, files, cloud, **scan):
        """As every recording does, the bundle's replays through the service, too."""
        again = Service(configuration=files["recording-1/slsd.toml"].decode())
        shutil.copytree(self.folder / "unpacked" / "recording-1", again.folder, dirs_exist_ok=True)
        with again, again.client() as client:
            told = client.call("scan", timeout_ms=600000, **scan)[1]
        self.assertEqual(bytes(told).split(b"end_header\n", 1)[1], bytes(cloud).split(b"end_header\n", 1)[1])

    def test_replays_the_part_that_each_scan_showed(self):
        table = f"[cloud]\nbox = {BOX}\nplane = {PLANE}\nstride = 2\n"
        clouds, files = self.check_replays_parts(table, [
            {}, {"density": "pixels"}, {"box": [], "plane": [], "stride": 1}, {"voxel_mm": 20.5},
            {"box": [BOX[0] + 0.1, *BOX[1:]], "plane": [], "density": "pixels", "voxel_mm": 3}])
        points = [len(cloud) for cloud in clouds]
        self.assertLess(points[0], points[2] / 2)
        self.assertLess(points[3], points[0])
        self.assertGreater(points[3], 1000)
        lines = [json.loads(line) for line in files["recording-1/scans.jsonl"].splitlines()]
        self.assertEqual(lines[0]["part"], {"box": BOX, "plane": PLANE, "box_frame": "rig", "voxel_mm": 0, "stride": 2})
        self.assertNotIn("part", lines[2])
        self.check_service_replays(files, clouds[0])

    def test_replays_a_part_in_the_robots_base(self):
        """On an arm, which has another pose at each scan; in a cell, the configuration alone places it."""
        pose = {"poses": "ur", "box_frame": "robot_base"}
        at = [[*robot_frame.POSE_UR], [0.41, -0.2, *robot_frame.POSE_UR[2:]]]
        boxes = [box_in_base(robot_frame.pose_of(each) @ robot_frame.MOUNT) for each in at]
        self.check_replays_parts('[frame]\nhand_eye = "hand_eye.yml"\n', [
            {"robot_pose": at[0], "box": boxes[0], **pose}, {"robot_pose": at[1], "box": boxes[1], **pose},
            {"robot_pose": at[1], "box": boxes[1], "density": "pixels", **pose}, {}], robot_frame.hand_eye("arm"))
        shutil.rmtree(self.folder / "unpacked")
        box = box_in_base(robot_frame.MOUNT)
        table = f'[frame]\nhand_eye = "hand_eye.yml"\n[cloud]\nbox = {box}\nbox_frame = "robot_base"\n'
        clouds, files = self.check_replays_parts(table, [{}, {"box": []}], robot_frame.hand_eye("cell"))
        self.assertLess(len(clouds[0]), 0.7 * len(clouds[1]))
        self.check_service_replays(files, clouds[0])

    def test_holds_what_the_service_says_of_itself(self):
        with service_on(["16px-5-bust"]) as service:
            slsctl("--socket", service.socket, "scan")
            files = self.bundle(service)
        about = json.loads(files["bundle.json"])
        self.assertEqual((about["format"], about["version"], about["reason"]), ("slsd bundle", 1, None))
        self.assertEqual(json.loads(files["status.json"])["scans"]["succeeded"], 1)
        self.assertEqual(json.loads(files["settings.json"])["cameras"][0]["name"], "camera")
        self.assertIn(b"slsd_scans_succeeded_total 1", files["metrics.txt"])
        line, = map(json.loads, files["recording-1/scans.jsonl"].splitlines())
        self.assertGreater(line["points"], 1000)
        self.assertIn(b"depth_min_mm = 1500.0", files["recording-1/slsd.toml"])

    def test_a_reload_begins_another_recording(self):
        with service_on(["16px-5-bust"]) as service, service.client() as client:
            client.call("scan", timeout_ms=600000)
            text = service.file.read_text(encoding="utf-8")
            service.file.write_text(text.replace("1500.0", "1600.0"), encoding="utf-8")
            client.call("reload")
            client.call("scan", timeout_ms=600000)
            files = self.bundle(service)
        self.assertIn(b"1500.0", files["recording-1/slsd.toml"])
        self.assertIn(b"1600.0", files["recording-2/slsd.toml"])
        self.assertEqual(replay(self.file).stdout.count("the same cloud"), 2)

    def test_keeps_the_newest_within_its_memory(self):
        """A frame is 1.92 MB."""
        with service_on(["16px-5-bust"], black_box="memory_max_mb = 4") as service, service.client() as client:
            names = [client.call("scan", timeout_ms=600000)[0]["scan"] for _ in range(4)]
            held = client.call("status")[0]["black_box"]
            files = self.bundle(service)
            lines = [json.loads(line) for line in files["recording-1/scans.jsonl"].splitlines()]
            self.assertEqual([line["scan"] for line in lines], names[2:])
            self.assertLessEqual(held["held_bytes"], held["limit_bytes"])
        for memory, what in ((1, "exceed [black_box] memory_max_mb"), (0, None)):
            with service_on(["16px-5-bust"], black_box=f"memory_max_mb = {memory}") as service:
                slsctl("--socket", service.socket, "scan")
                files = self.bundle(service)
                if what is None:
                    self.assertNotIn("recording-1/scans.jsonl", files)
                else:
                    line, = map(json.loads, files["recording-1/scans.jsonl"].splitlines())
                    self.assertIn(what, line["frames_left_out"])
            self.assertEqual(replay(self.file).returncode, 0)

    def test_a_scan_that_fails_in_a_new_way_writes_one(self):
        """A camera of another size than calibrated: the frame that explains it is there, and no command was needed."""
        state = self.folder / "state"
        with service_on(["16px-5-bust"], environment={"STATE_DIRECTORY": str(state)}) as service:
            service.wait_ready()
            with service.client() as client:
                client.call("scan", timeout_ms=600000)
                (service.folder / "frames" / "0.png").write_bytes(b"P5 640 480 255\n" + bytes(640 * 480))
                for _ in range(3):
                    with self.assertRaises(RpcError):
                        client.call("scan", timeout_ms=500)
                wait_until(lambda: client.call("status")[0]["black_box"]["bundles_written"] > 0, "a bundle")
                self.assertEqual(client.call("status")[0]["black_box"]["bundles_written"], 1)
            wait_until(lambda: "failed in a new way" in service.log_text(), "the line of the log")
            file, = (state / "bundles").iterdir()
            # Opened with that picture, it is the decoder that refuses: another way, of which the frame is there. In a third
            # life both are known.
            for life in (2, 3):
                service.stop()
                service.log.unlink()
                service.start()
                self.assertEqual(slsctl("--socket", service.socket, "scan").returncode, 1)
                wait_until(lambda: len(list((state / "bundles").glob("*.tar"))) == 2, "another bundle")
                if life == 3:
                    service.stop()
                    self.assertNotIn("new way", service.log_text())
            self.assertEqual(len(list((state / "bundles").iterdir())), 2)
            second, = set((state / "bundles").iterdir()) - {file}
            result = replay(second)
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            self.assertIn("failed (mismatch): fails again: ", result.stdout)
            self.assertEqual(stat.S_IMODE((state / "bundles").stat().st_mode), 0o700)
        files = unpacked(file)
        reason = json.loads(files["bundle.json"])["reason"]
        self.assertIn(reason["error"]["data"]["name"], file.name)
        result = replay(file)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn(reason["error"]["message"], result.stdout)
        self.assertIn("the same cloud, byte for byte", result.stdout)

    def refused(self, files, expected, **changes):
        """What a bundle of these files is refused with."""
        with tarfile.open(self.file, "w", format=tarfile.USTAR_FORMAT) as archive:
            for name, content in files.items():
                member = tarfile.TarInfo(name)
                member.size = len(content)
                for key, value in changes.get(name.replace("/", "_").replace(".", "_"), {}).items():
                    setattr(member, key, value)
                archive.addfile(member, io.BytesIO(content))
        result = replay(self.file, "--unpack", self.folder / "unpacked")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertRegex(result.stderr, expected)
        shutil.rmtree(self.folder / "unpacked", ignore_errors=True)

    def test_refuses_what_an_enemy_made(self):
        with service_on(["16px-5-bust"]) as service:
            slsctl("--socket", service.socket, "scan")
            files = self.bundle(service)
        whole = self.file.read_bytes()
        for length in (0, 100, 511, 512, 5000, len(whole) // 2, len(whole) - 1024, len(whole) - 512):
            self.file.write_bytes(whole[:length])
            result = replay(self.file)
            self.assertEqual(result.returncode, 1)
            self.assertIn("is cut", result.stderr)
        self.file.write_bytes(whole + b"x" * 512)
        self.assertIn("after its end", replay(self.file).stderr)
        version = files["bundle.json"].replace(b'"version": 1', b'"version": 2')
        self.refused({"bundle.json": version}, "has version 2")
        self.refused({"bundle.json": b"{}"}, "not a bundle of slsd")
        self.refused({"bundle.json": b"[" * 60000}, "not a JSON object")
        self.refused({"bundle.json": b"x" * 100_000}, "is too long")
        self.refused({"other": b""}, "does not begin with bundle.json")
        for name in ("../escape", "/etc/escape", "recording-1/../../escape", "a//b", "a/", ".bashrc", "a/.ssh", "-rf",
                     "a\nb", "a" * 100):
            self.refused({"bundle.json": files["bundle.json"], name: b""}, "might lead outside|not a regular file|another format")
        for kind in (tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE, tarfile.DIRTYPE):
            self.refused({"bundle.json": files["bundle.json"], "link": b""}, "not a regular file",
                         link={"type": kind, "linkname": "/etc/passwd"})
        self.refused({"bundle.json": files["bundle.json"], **{f"{i}": b"" for i in range(5000)}}, "more than 4096")
        for missing in ("recording-1/calibration.yml", "recording-1/pattern.toml", "recording-1/scans.jsonl",
                        "recording-1/camera/00000000.png", "recording-1/clouds/00000000.ply"):
            self.refused({name: data for name, data in files.items() if name != missing}, f"{missing}: is missing")
        # A picture of 4 gigapixels in 70 bytes, and one of another camera.
        bomb = bytes.fromhex("89504e470d0a1a0a0000000d49484452") + b"\0\1\0\0\0\1\0\0\10\0\0\0\0" + bytes(40)
        self.refused({**files, "recording-1/camera/00000000.png": bomb}, "recording-1")
        self.refused({**files, "recording-1/camera/00000000.png": b"P5 8 8 255\n" + bytes(64)}, "differ from the bundle")
        lines = files["recording-1/scans.jsonl"].replace(b'"camera":"camera"', b'"camera":"other"')
        self.refused({**files, "recording-1/scans.jsonl": lines}, "order of the cameras")
        lines = files["recording-1/scans.jsonl"].replace(b"camera/00000000.png", b"../../../etc/passwd")
        self.refused({**files, "recording-1/scans.jsonl": lines}, "passwd: is missing from the bundle")
        for part, said in (('7', "part must be an object"), ('{"box":[1,2]}', "box must have six numbers"), ('{"box":[1,2,3,4,5,"6"]}', "lists of numbers"),
                           ('{"stride":4294967297}', "stride must be from 1 to 64"), ('{"voxel_mm":-1}', "voxel_mm must be from 0 to 1000"),
                           ('{"plane":[0,0,1e300,0]}', "plane must have four numbers"), ('{"base_from_rig":[1,2]}', "base_from_rig .*16"),
                           ('{"base_from_rig":[1,0,0,0,0,2,0,0,0,0,1,0,0,0,0,1]}', "base_from_rig .*no rotation")):
            lines = files["recording-1/scans.jsonl"].replace(b'"density"', f'"part":{part},"density"'.encode())
            self.refused({**files, "recording-1/scans.jsonl": lines}, said)
        other = files["recording-1/clouds/00000000.ply"][:-1] + b"\x7f"
        self.refused({**files, "recording-1/clouds/00000000.ply": other}, "differ from the bundle")
        self.assertEqual(replay(self.folder).returncode, 1)
        self.assertEqual(replay(self.folder / "none").returncode, 1)
        self.assertEqual(os.listdir(self.folder), ["bundle.tar"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
