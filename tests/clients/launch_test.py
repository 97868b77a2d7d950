#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The ROS 2 package: `ros2 launch slsd scanner.launch.py`, and the robot description.

Where ROS 2 is installed, ros2 launches it. Everywhere else the interpreter of play_launch, another program for launch
files, says which programs it starts, and they are started. SLSD_ROS_PYTHON as in ros_test.py.
"""
import contextlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import numpy as np  # noqa: E402
import yaml  # noqa: E402

from dds_bridge import DOMAIN, matrix, probe, transforms, turn  # noqa: E402
from ros_test import PYTHON, has_ros, node  # noqa: E402
from service import BIN, Service, wait_until  # noqa: E402

PACKAGE = HERE.parents[1] / "clients/ros/slsd"
LAUNCH = "launch/scanner.launch.py"


def opencv(key, rows, cols, numbers):
    data = ", ".join(repr(float(number)) for number in np.ravel(numbers))
    return f"{key}: !!opencv-matrix {{ rows: {rows}, cols: {cols}, dt: d, data: [ {data} ] }}\n"


def camera(name, projector_from_camera, rig_from_camera=None):
    """One of a calibration; each pose is a rotation and a translation in millimetres."""
    lines = [f'name: "{name}"\n', "width: 1600\n", "height: 1200\n",
             opencv("camera_matrix", 3, 3, [3500, 0, 800, 0, 3500, 600, 0, 0, 1]), opencv("camera_distortion", 1, 5, [0] * 5)]
    for prefix, pose in (("", projector_from_camera), ("rig_from_camera_", rig_from_camera)):
        if pose:
            lines += [opencv(prefix + "R", 3, 3, pose[0]), opencv(prefix + "T", 3, 1, pose[1])]
    return "   -\n" + "".join("      " + line for line in lines)


def calibration(*cameras):
    return ("%YAML:1.0\n---\nprojector_width: 1280\nprojector_height: 800\n" +
            opencv("projector_matrix", 3, 3, [2500, 0, 640, 0, 2500, 400, 0, 0, 1]) +
            opencv("projector_distortion", 1, 5, [0] * 5) + "cameras:\n" + "".join(cameras))


def rotation(axis, angle):
    """About one of the axes x, y and z, right-handed."""
    c, s = np.cos(angle), np.sin(angle)
    r, i, j = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    r[i, i], r[i, j], r[j, i], r[j, j] = c, -s, s, c
    return r


def describe(*arguments):
    return subprocess.run([BIN / "slsd-dds", "--describe", *map(str, arguments)], capture_output=True, text=True, timeout=600,
                          check=True).stdout


def joints(urdf):
    """Of a robot description: parent, rotation and translation (metres) by the child."""
    found = {}
    for joint in ElementTree.fromstring(urdf.encode()).iter("joint"):
        origin = joint.find("origin")
        roll, pitch, yaw = map(float, origin.get("rpy").split())
        found[joint.find("child").get("link")] = (
            joint.find("parent").get("link"), rotation(2, yaw) @ rotation(1, pitch) @ rotation(0, roll),
            np.array([float(one) for one in origin.get("xyz").split()]))
    return found


class Description(unittest.TestCase):
    def same(self, joint, parent, r, t_mm):
        self.assertEqual(joint[0], parent)
        np.testing.assert_allclose(joint[1], r, atol=1e-9)
        np.testing.assert_allclose(joint[2], np.ravel(t_mm) / 1000, atol=1e-12)

    def test_has_the_joints_of_calibrations(self):
        for file in sorted((HERE / "recorded").glob("*/calibration.yml")) + sorted((HERE / "cell").glob("*/calibration.yml")):
            text = file.read_text(encoding="utf-8")
            r, t = np.reshape(matrix(text, r"\bR"), (3, 3)), np.array(matrix(text, r"\bT"))
            found = joints(describe(file))
            self.same(found["scanner_projector_optical_frame"], "scanner_optical_frame", r.T, -r.T @ t)
            # Of the optical frame z is forward, x right and y down.
            self.same(found["scanner_optical_frame"], "scanner_link", [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0, 0, 0])

    def test_has_the_joints_of_any_direction(self):
        random = np.random.default_rng(1)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "calibration.yml"
            for i in range(40):
                # Every other one is upright, or nearly so, where roll and yaw are one.
                pitch = random.choice([-1, 1]) * (np.pi / 2 - random.choice([0, 1e-12, 1e-8, 1e-5])) if i % 2 else random.uniform(-1, 1)
                r = rotation(2, random.uniform(-3, 3)) @ rotation(1, pitch) @ rotation(0, random.uniform(-3, 3))
                rig = rotation(2, random.uniform(-3, 3)) @ rotation(1, random.uniform(-1, 1))
                r = rig.T @ (rig @ r)  # rounded as what is computed
                name, frame = (("right-2", "s_right_2_optical_frame"), ("projector", "s_camera_projector_optical_frame"))[i % 3 == 0]
                t, at = random.uniform(-300, 300, 3), random.uniform(-300, 300, 3)
                file.write_text(calibration(camera("left", (r.T, -r.T @ t)), camera(name, (r.T @ rig, r.T @ (at - t)), (rig, at))),
                                encoding="utf-8")
                found = joints(describe(file, "--name", "s"))
                self.same(found["s_projector_optical_frame"], "s_optical_frame", r, t)
                self.same(found[frame], "s_optical_frame", rig, at)

    @unittest.skipUnless(shutil.which("check_urdf"), "no check_urdf (liburdfdom-tools)")
    def test_is_read_by_urdfdom(self):
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(describe(HERE / "cell/left/calibration.yml"))
            file.flush()
            for urdf in (file.name, PACKAGE / "urdf/example.urdf"):
                tree = subprocess.run(["check_urdf", urdf], capture_output=True, text=True, check=True).stdout
                self.assertRegex(tree, r"root Link: scanner_link has 1 child\(ren\)\s+child\(1\):  scanner_optical_frame\s+"
                                       r"child\(1\):  scanner_projector_optical_frame")

    def test_of_the_example_is_that_of_the_drawn_scanner(self):
        text = (PACKAGE / "urdf/example.urdf").read_text(encoding="utf-8")
        self.assertIn("AN EXAMPLE", text)
        lines = describe(HERE / "cell/left/calibration.yml").splitlines()
        self.assertEqual([line for line in text.splitlines() if line in lines], lines)

    def test_that_extrinsics_place_begins_at_the_camera(self):
        found = joints(describe(HERE / "cell/left/calibration.yml", "--extrinsics", "cell.toml"))
        self.assertEqual(list(found), ["scanner_projector_optical_frame"])

    def test_of_nothing_is_refused(self):
        with Service(configuration="[server]\nsocket = \"slsd.sock\"\n") as service:
            for arguments, word in ((["--socket", service.socket], "slsctl calibrate"), (["--socket", "/nowhere"], "start slsd"),
                                    (["/nowhere.yml"], "/nowhere.yml"), (["--name", "left-1"], "letters, digits and _")):
                done = subprocess.run([BIN / "slsd-dds", "--describe", *map(str, arguments)], capture_output=True, text=True,
                                      timeout=600, check=False)
                self.assertEqual((done.returncode in (1, 2), done.stdout), (True, ""))
                self.assertIn(word, done.stderr)


def installed(prefix):
    """The package as `cmake --install` lays it out, in share/slsd/ros of the prefix."""
    subprocess.run(["cmake", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-P", BIN.parent / "clients/ros/cmake_install.cmake"],
                   capture_output=True, check=True, env={"PATH": "/usr/bin:/bin"})
    return pathlib.Path(prefix) / "share/slsd/ros"


def sourced(shell, prefix, ament_prefix_path=""):
    """What is in the environment after two times sourcing."""
    script = f'. {prefix}/setup.{shell}; . {prefix}/setup.{shell}; printf "%s\\n%s\\n" "$AMENT_PREFIX_PATH" "$PATH"'
    environment = {"PATH": "/usr/bin:/bin", **({"AMENT_PREFIX_PATH": ament_prefix_path} if ament_prefix_path else {})}
    return subprocess.run([shell, "-c", script], capture_output=True, text=True, check=True, env=environment).stdout.splitlines()


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.prefix = installed(cls.folder)

    def test_is_found_after_its_setup(self):
        for shell in ("sh", "bash", "zsh"):
            ament, path = sourced(shell, self.prefix)
            self.assertEqual((ament, path), (str(self.prefix), f"{self.folder}/bin:/usr/bin:/bin"))
            self.assertEqual(sourced(shell, self.prefix, "/opt/ros")[0], f"{self.prefix}:/opt/ros")

    def test_is_what_colcon_installs(self):
        root, copy = self.folder / "colcon", self.folder / "source"
        shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
        subprocess.run(["/usr/bin/python3", "setup.py", "-q", "install_data", "--install-dir", root], cwd=copy, check=True,
                       capture_output=True)
        files = {file.relative_to(root): file.read_bytes() for file in root.rglob("*") if file.is_file()}
        ours = {file.relative_to(self.prefix): file.read_bytes() for file in (self.prefix / "share").rglob("*") if file.is_file()}
        self.assertIn(pathlib.Path("share/ament_index/resource_index/packages/slsd"), ours)
        self.assertEqual(ours, files)

    def test_is_of_the_same_version(self):
        version = subprocess.run([BIN / "slsd-dds", "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
        package = ElementTree.parse(PACKAGE / "package.xml").getroot()
        self.assertEqual([package.findtext("name"), package.findtext("version")], ["slsd", version])

    @unittest.skipUnless(has_ros(), "no ament_index_python: the wheels of ROS 2 come from the network")
    def test_is_found_by_the_index_of_ament(self):
        share = subprocess.run([PYTHON, "-c", "import ament_index_python as i; print(i.get_package_share_directory('slsd'))"],
                               capture_output=True, text=True, check=True,
                               env={"AMENT_PREFIX_PATH": sourced("bash", self.prefix)[0]}).stdout
        self.assertEqual(share.strip(), str(self.prefix / "share/slsd"))


def has_interpreter():
    try:
        return subprocess.run([PYTHON, HERE / "launch_file.py", PACKAGE / LAUNCH], capture_output=True, timeout=600,
                              check=False).returncode == 0
    except OSError:
        return False


def read(*arguments, path=BIN, **environment):
    """What the launch file starts."""
    done = subprocess.run([PYTHON, HERE / "launch_file.py", PACKAGE / LAUNCH, *map(str, arguments)], capture_output=True, text=True,
                          timeout=600, check=True, env={"PATH": f"{path}:/usr/bin:/bin", **environment})
    return json.loads(done.stdout)


LOOPBACK = {"ROS_DOMAIN_ID": str(DOMAIN), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


class Seen(unittest.TestCase):
    """What a launched scanner has to show."""

    def shows(self, name, service):
        cloud = probe(f"{name}/points", "PointCloud2")[0].point_cloud()
        self.assertEqual(cloud["header"]["frame_id"], f"{name}_optical_frame")
        self.assertGreater(cloud["width"], 100)
        with service.client() as client:
            text = client.call("settings")[0]["calibration"]
        r, t = np.reshape(matrix(text, r"\bR"), (3, 3)), np.array(matrix(text, r"\bT"))
        found = joints(probe(f"{name}/robot_description", "String", "--latched")[0].text())
        self.assertEqual(set(found), set(transforms()))
        for child, transform in transforms().items():
            self.assertEqual(transform["header"]["frame_id"], found[child][0])
            np.testing.assert_allclose(turn(transform["rotation"]), found[child][1], atol=1e-9)
            np.testing.assert_allclose(transform["translation"], found[child][2], atol=1e-9)
        np.testing.assert_allclose(found[f"{name}_projector_optical_frame"][1], r.T, atol=1e-9)
        np.testing.assert_allclose(found[f"{name}_projector_optical_frame"][2], -r.T @ t / 1000, atol=1e-9)


@unittest.skipUnless(has_interpreter(), "no play_launch: it comes from the Python package index")
class LaunchFile(Seen):
    def started(self, *arguments, **environment):
        return [(pathlib.Path(program["command"][0]).name, program["command"][1:]) for program in
                read(*arguments, **environment)["programs"]]

    def test_describes_its_arguments(self):
        said_ = read()
        self.assertEqual(said_["unsupported"], [])
        self.assertEqual(set(said_["arguments"]), set(said_["values"]))
        readme = (PACKAGE.parent / "README.md").read_text(encoding="utf-8")
        for name, description in said_["arguments"].items():
            self.assertTrue(description)
            self.assertIn(f"| `{name}` |", readme)

    def test_starts_the_service_if_nobody_answers(self):
        usual = ["--name", "scanner", "--socket", "/nowhere/slsd.sock", "--image-rate", "2"]
        self.assertEqual(self.started("socket:=/nowhere/slsd.sock"), [("slsd", []), ("slsd-dds", usual)])
        self.assertEqual(self.started(SLSD_SOCKET="/nowhere/slsd.sock"), [("slsd", []), ("slsd-dds", usual)])
        self.assertEqual(self.started("socket:=/nowhere/slsd.sock", "start_service:=false"), [("slsd-dds", usual)])

    def test_leaves_a_service_that_answers_alone(self):
        with Service() as service:
            usual = ["--name", "scanner", "--socket", str(service.socket), "--image-rate", "2"]
            self.assertEqual(self.started(f"socket:={service.socket}"), [("slsd-dds", usual)])
            for arguments in (["start_service:=true", f"socket:={service.socket}"], [f"config:={service.file}"]):
                self.assertIn("a service answers here already", read(*arguments)["error"])

    def test_gives_the_socket_of_the_configuration(self):
        service = Service()
        self.assertEqual(self.started(f"config:={service.file}"), [
            ("slsd", ["--config", str(service.file)]),
            ("slsd-dds", ["--name", "scanner", "--socket", str(service.socket), "--image-rate", "2"])])

    def test_passes_options_on(self):
        (_, _), (_, command) = self.started("name:=left", "socket:=/nowhere/s", "rate:=5", "density:=pixels", "stride:=4", "voxel:=2.5",
                                            "image_rate:=0", "extrinsics:=cell of two.toml", "flange:=tool0", "robot_base:=foot",
                                            "transforms:=false")
        self.assertEqual(command, ["--name", "left", "--socket", "/nowhere/s", "--rate", "5", "--density", "pixels", "--stride", "4",
                                   "--voxel", "2.5", "--image-rate", "0", "--extrinsics", "cell of two.toml", "--flange", "tool0", "--robot-base", "foot",
                                   "--no-transforms"])
        done = subprocess.run([BIN / "slsd-dds", *command, "--describe", HERE / "cell/left/calibration.yml"], capture_output=True,
                              timeout=600, check=False)
        self.assertEqual(done.returncode, 0)

    def test_refuses_what_it_does_not_know(self):
        self.assertIn("maybe", read("rviz:=maybe")["error"])
        self.assertIn("slsd-dds is not installed", read("socket:=/nowhere/s", path="/nowhere")["error"])

    def test_shows_the_scanner_in_rviz_by_its_names(self):
        config = yaml.safe_load((PACKAGE / "rviz/scanner.rviz").read_text(encoding="utf-8"))
        topics = {display[key]["Value"] for display in config["Visualization Manager"]["Displays"]
                  for key in ("Topic", "Description Topic") if key in display}
        with Service(configuration=(Service().file.read_text(encoding="utf-8").replace('"camera"', '"left eye"'))) as service:
            rviz = read("rviz:=true", "name:=top", f"socket:={service.socket}")["programs"][-1]
        self.assertEqual((rviz["package"], rviz["command"][0]), ("rviz2", "rviz2"))
        self.assertEqual(rviz["command"][1:], ["-d", str(PACKAGE / "rviz/scanner.rviz"), "-f", "top_link"])
        self.assertEqual(rviz["remappings"], {"/scanner/points": "/top/points", "/scanner/robot_description": "/top/robot_description",
                                              "/scanner/camera/image_raw": "/top/left_eye/image_raw"})
        self.assertEqual(topics, set(rviz["remappings"]))

    def test_shows_clouds_in_rviz_in_their_frame(self):
        for arguments, frame in (([], "top_link"), (["extrinsics:=cell.toml"], "top_optical_frame"), (["flange:=tool0"], "base_link"),
                                 (["flange:=tool0", "robot_base:=foot"], "foot"), (["robot_base:=foot"], "top_link")):
            rviz = read("rviz:=true", "name:=top", "socket:=/nowhere/s", *arguments)["programs"][-1]
            self.assertEqual(rviz["command"][-2:], ["-f", frame], arguments)

    @contextlib.contextmanager
    def launched(self, **environment):
        """A service of a recorded frame, and what shows it as "left"."""
        service = Service()
        programs = read("name:=left", f"config:={service.file}", "rate:=5")["programs"]
        running = [subprocess.Popen(program["command"], env={**os.environ, **LOOPBACK, **environment}) for program in programs]
        try:
            wait_until(service.socket.exists, "the socket")
            service.wait_ready()
            yield service
        finally:
            for process in running:
                process.send_signal(signal.SIGINT)  # as ros2 launch does
            self.assertEqual([process.wait(600) for process in running], [0, 0])

    def test_shows_a_recorded_frame(self):
        with self.launched() as service:
            self.shows("left", service)

    @unittest.skipUnless(has_ros(), "no rclpy: the wheels of ROS 2 come from the network")
    def test_is_seen_by_a_node_of_ros(self):
        with self.launched():
            seen = node("--calls", "1", "--topics", "points", "image")
        self.assertEqual(seen["points"]["frame_id"], "left_optical_frame")
        self.assertGreater(seen["counts"]["image"], 2)
        self.assertTrue(seen["answers"][0][0], seen["answers"])


def has_ros2():
    try:
        return subprocess.run(["ros2", "launch", "--help"], capture_output=True, timeout=600, check=False).returncode == 0
    except OSError:
        return False


@unittest.skipUnless(has_ros2(), "no ros2 launch: ROS 2 is not installed here")
class Ros2(Seen):
    def test_launches_a_recorded_frame(self):
        service = Service()
        with tempfile.TemporaryDirectory() as folder, open(pathlib.Path(folder) / "log", "w+", encoding="utf-8") as log:
            environment = {**os.environ, **LOOPBACK, "PATH": f"{BIN}:{os.environ['PATH']}", "ROS_LOG_DIR": folder,
                           "AMENT_PREFIX_PATH": f"{installed(folder)}:{os.environ.get('AMENT_PREFIX_PATH', '')}"}
            command = ["ros2", "launch", "slsd", "scanner.launch.py"]
            shown = subprocess.run([*command, "--show-args"], capture_output=True, text=True, check=True, env=environment).stdout
            self.assertIn("image_rate", shown)
            launched = subprocess.Popen([*command, "name:=left", f"config:={service.file}", "rate:=5"], env=environment, stdout=log,
                                        stderr=subprocess.STDOUT)
            try:
                wait_until(service.socket.exists, "the socket")
                service.wait_ready()
                self.shows("left", service)
            finally:
                launched.send_signal(signal.SIGINT)
                launched.wait(600)


if __name__ == "__main__":
    unittest.main()
