#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Scans with colour: from colour files, from a Bayer mosaic and from a texture camera, in every format, and what is
refused."""
import pathlib
import shutil
import struct
import tempfile
import unittest

import numpy as np

from client import RpcError
from service import SCENE, Service, slsctl, slsd

KINDS = {"float": "<f4", "uchar": "u1", "int": "<i4"}
INVALID_ARGUMENT, INVALID_PARAMS, UNSUPPORTED = -32001, -32602, -32010
WIDTH, HEIGHT, FOCAL_PX = 800, 600, 1400  # of the texture camera, which stands 150 mm beside the other
BESIDE_MM = np.array([150, -30, 0])


def ply(bytes_):
    """The records of any of slsd's PLY clouds."""
    header, body = bytes_.split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode().split("\n")]
    return np.frombuffer(body, np.dtype([(line[2], KINDS[line[1]]) for line in lines if line[:1] == ["property"]]))


def pcd(bytes_):
    """The measured points of a PCD, and their colours, which PCL packs into a float."""
    header, body = bytes_.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in header.decode().split("\n") if line and line[0] != "#")
    kinds = [{"F": "<f4", "U": "u1", "I": "<i4"}[kind] for kind in fields["TYPE"].split()]
    points = np.frombuffer(body, np.dtype(list(zip(fields["FIELDS"].split(), kinds))))
    points = points[~np.isnan(points["z"])]
    packed = np.ascontiguousarray(points["rgb"]).view("<u4")
    return points, np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1)


def colours(points):
    return np.stack([points[name] for name in ("red", "green", "blue")], axis=1).astype(int)


def gradient(width, height):
    """Red grows to the right, blue falls downwards: each place of the picture has its own colour."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return np.stack([40 + x // 10, np.full_like(x, 120), 200 - y // 10], axis=2).astype(np.uint8)


def seen_at(points):
    """The gradient at the places of points."""
    return np.stack([40 + points["camera_u"] / 10, np.full(len(points), 120), 200 - points["camera_v"] / 10], axis=1)


class Colour(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.frames = pathlib.Path(temporary.name) / "frames"
        self.frames.mkdir()
        shutil.copy(SCENE / "frame.png", self.frames)
        self.picture = gradient(1600, 1200)

    def record(self, folder, picture, frames=None):
        frames = frames or self.frames
        (frames / folder).mkdir(parents=True, exist_ok=True)
        height, width = picture.shape[:2]
        header = f"P{6 if picture.ndim == 3 else 5} {width} {height} 255\n"
        (frames / folder / "0.ppm").write_bytes(header.encode() + picture.astype(np.uint8).tobytes())

    def record_texture(self, folder, picture):
        self.record(folder, picture, self.frames.parent / "texture")

    def serve(self, camera=""):
        service = Service(camera_path=self.frames, camera=camera).start()
        self.addCleanup(service.__exit__)
        client = service.client()
        self.addCleanup(client.close)
        return service, client

    def scan(self, service, file, *options):
        written = slsctl("--socket", service.socket, "scan", "--colour", "--timeout-ms", "600000", "-o", file, *options)
        self.assertEqual(written.returncode, 0, written.stderr)

    def refused(self, client, code, **params):
        with self.assertRaises(RpcError) as raised:
            client.call("scan", **params)
        self.assertEqual(raised.exception.code, code)
        return str(raised.exception)

    def test_points_have_the_colour_of_their_place(self):
        self.record("white", self.picture)
        _, client = self.serve()
        points = ply(client.call("scan", colour=True)[1])
        self.assertGreater(len(points), 1000)
        self.assertLess(np.abs(colours(points) - seen_at(points)).max(), 2)
        grey = colours(points) @ [0.299, 0.587, 0.114]
        self.assertLess(np.abs(grey - points["intensity"]).max(), 2)
        organised, packed = pcd(client.call("scan", colour=True, format="pcd")[1])
        self.assertLess(np.abs(packed - seen_at(organised)).max(), 2)
        self.assertNotIn("red", ply(client.call("scan", texture=True)[1]).dtype.names)

    def test_pixels_have_their_own_colour_in_every_format(self):
        self.record("white", self.picture)
        service, client = self.serve()
        for normals in (False, True):
            scan, cloud = client.call("scan", colour=True, density="pixels", normals=normals, format="pcd")
            points, packed = pcd(cloud)
            self.assertEqual(len(points), scan["points"])
            measured = ~np.isnan(np.frombuffer(
                cloud.split(b"DATA binary\n", 1)[1], points.dtype)["z"].reshape(scan["height_px"], scan["width_px"]))
            np.testing.assert_array_equal(packed, self.picture[measured])
            same = ply(client.call("scan", colour=True, density="pixels", normals=normals)[1])
            np.testing.assert_array_equal(colours(same), packed)
            self.scan(service, service.folder / "cloud.ply", "--density", "pixels", *(["--normals"] if normals else []),
                      "--cloud-picture", service.folder / "cloud.png")
            np.testing.assert_array_equal(colours(ply((service.folder / "cloud.ply").read_bytes())), packed)

    def test_meshes_show_the_colour(self):
        self.record("white", self.picture)
        service, _ = self.serve()
        for kind in ("obj", "glb"):
            self.scan(service, service.folder / f"mesh.{kind}")
        lines = [line.split() for line in (service.folder / "mesh.obj").read_text().split("\n") if line.startswith("v ")]
        of_vertices = np.rint(255 * np.array([line[4:7] for line in lines], dtype=float)).astype(int)
        self.assertEqual(set(of_vertices[:, 1]), {120})
        self.assertGreater(np.ptp(of_vertices[:, 0]), 60)
        glb = (service.folder / "mesh.glb").read_bytes()
        data = glb[28 + struct.unpack_from("<I", glb, 12)[0]:]
        of_glb = np.frombuffer(data, "u1", 4 * len(lines), 24 * len(lines)).reshape(-1, 4)
        np.testing.assert_array_equal(of_glb[:, :3], of_vertices)

    def test_colour_comes_from_a_mosaic(self):
        mosaic = np.empty(self.picture.shape[:2], np.uint8)
        for down, right, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
            mosaic[down::2, right::2] = self.picture[down::2, right::2, channel]
        self.record("white", mosaic)
        _, client = self.serve('bayer = "RGGB"\nwhite_balance = [0.5, 1, 1.2]')
        scan, cloud = client.call("scan", colour=True)
        points = ply(cloud)
        self.assertGreater(len(points), 1000)
        self.assertLess(np.abs(colours(points) - seen_at(points) * [0.5, 1, 1.2]).max(), 2.5)
        mean = (colours(points) / [0.5, 1, 1.2]).mean(axis=0)
        np.testing.assert_allclose(scan["white_balance"]["camera"], [mean[1] / mean[0], 1, mean[1] / mean[2]], atol=0.01)
        red, green, blue = (colours(points) / [0.5, 1, 1.2]).T
        self.assertLess(np.abs((red + 2 * green + blue) / 4 - points["intensity"]).max(), 2)

    def test_room_light_is_subtracted(self):
        self.record("white", self.picture)
        self.record("dark", np.full_like(self.picture, (10, 20, 30)))
        _, client = self.serve()
        points = ply(client.call("scan", colour=True, ambient=True)[1])
        self.assertLess(np.abs(colours(points) - (seen_at(points) - [10, 20, 30])).max(), 2)

    def calibrate_texture(self, file):
        """The scene's calibration, and that of a texture camera that looks in the same direction from beside."""
        text = (SCENE / "calibration.yml").read_text(encoding="utf-8")

        def numbers(name):
            values = text.split(f" {name}: !!", 1)[1].split("data: [", 1)[1].split("]", 1)[0]
            return np.array([float(value) for value in values.split(",")])

        turn, move = numbers("R").reshape(3, 3), numbers("T")

        def matrix(name, values):
            rows, columns = values.shape
            return (f"      {name}: !!opencv-matrix\n         rows: {rows}\n         cols: {columns}\n         dt: d\n"
                    f"         data: [ {', '.join(f'{value:.17g}' for value in values.flat)} ]\n")

        lens = np.array([[FOCAL_PX, 0, (WIDTH - 1) / 2], [0, FOCAL_PX, (HEIGHT - 1) / 2], [0, 0, 1]])
        file.write_text(text + f'   -\n      name: "texture"\n      width: {WIDTH}\n      height: {HEIGHT}\n'
                        + matrix("camera_matrix", lens) + matrix("camera_distortion", np.zeros((1, 5)))
                        + matrix("R", turn) + matrix("T", (turn @ BESIDE_MM + move)[:, None])
                        + matrix("rig_from_camera_R", np.eye(3)) + matrix("rig_from_camera_T", BESIDE_MM[:, None]),
                        encoding="utf-8")

    def serve_texture(self, calibrated=True, texture="", server=""):
        """A service with the texture camera first in its file."""
        self.record("white", gradient(1600, 1200)[:, :, 1])
        self.record_texture("", np.zeros((HEIGHT, WIDTH, 3)))
        calibration = self.frames.parent / "calibration.yml"
        if calibrated:
            self.calibrate_texture(calibration)
        else:
            shutil.copy(SCENE / "calibration.yml", calibration)
        service = Service(configuration=f"""
[pattern]
file = "{SCENE}/pattern.toml"
[[camera]]
name = "texture"
path = "{self.frames.parent / "texture"}"
use = "texture"
{texture}
[[camera]]
name = "camera"
path = "{self.frames}"
[calibration]
file = "{calibration}"
[scan]
timeout_ms = 600000
[server]
socket = "slsd.sock"
{server}
""")
        return service

    def client_of(self, service):
        client = service.start().client()
        self.addCleanup(service.__exit__)
        self.addCleanup(client.close)
        return client

    def seen_by_texture(self, points):
        """The gradient at the places where the texture camera sees points."""
        places = np.stack([points["x"], points["y"], points["z"]], axis=1).astype(float) - BESIDE_MM
        u = FOCAL_PX * places[:, 0] / places[:, 2] + (WIDTH - 1) / 2
        v = FOCAL_PX * places[:, 1] / places[:, 2] + (HEIGHT - 1) / 2
        inside = (u >= 1) & (v >= 1) & (u < WIDTH - 2) & (v < HEIGHT - 2)
        return inside, np.stack([40 + u / 10, np.full(len(u), 120), 200 - v / 10], axis=1)

    def check_texture(self, scan, points):
        inside, colour = self.seen_by_texture(points)
        painted = (colours(points) != 255).any(axis=1)
        self.assertGreater(np.sum(inside), 1000)
        self.assertGreater(np.sum(~inside), 10)  # beyond the edge of its picture
        self.assertFalse(np.any(painted & ~inside))
        self.assertLess(np.sum(inside & ~painted), 0.01 * len(points))
        self.assertLess(np.abs(colours(points) - colour)[painted].max(), 2)
        self.assertEqual(scan["unseen"], np.sum(~painted))
        self.assertEqual(set(points["intensity"]), {120})  # the other camera's own
        self.assertEqual(scan["saturated"], 0)

    def test_a_texture_camera_gives_the_colours_of_others_points(self):
        self.record_texture("white", gradient(WIDTH, HEIGHT))
        service = self.serve_texture()
        client = self.client_of(service)
        plain, uncoloured = client.call("scan", texture=True)
        self.assertNotIn("unseen", plain)
        for form in ({}, {"density": "pixels"}, {"density": "pixels", "normals": True}):
            scan, cloud = client.call("scan", colour=True, **form)
            self.check_texture(scan, ply(cloud))
            self.assertIn("texture", scan["white_balance"])
            self.assertNotIn("camera", scan["white_balance"])
            if not form:  # colours leave the points as they are
                for name in ("x", "y", "z", "sigma_mm"):
                    np.testing.assert_array_equal(ply(cloud)[name], ply(uncoloured)[name])
        boxed, cloud = client.call("scan", colour=True, box=[-300, -200, 1900, 300, 200, 2100])
        self.assertGreater(boxed["points"], 300)
        self.assertEqual(boxed["unseen"], 0)
        without, of_box = client.call("scan", texture=True, box=[-300, -200, 1900, 300, 200, 2100])
        self.assertEqual(without["regions"], boxed["regions"])
        np.testing.assert_array_equal(ply(cloud)["z"], ply(of_box)["z"])
        told = slsctl("--socket", service.socket, "scan", "--colour", "-o", service.folder / "cloud.ply")
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertIn("no texture camera sees", told.stdout + told.stderr)

    def test_the_room_is_subtracted_from_a_texture_cameras_colours(self):
        self.record_texture("white", gradient(WIDTH, HEIGHT))
        self.record_texture("dark", np.full((HEIGHT, WIDTH, 3), (10, 20, 30)))
        self.record("dark", np.full((1200, 1600), 5))
        client = self.client_of(self.serve_texture(texture="white_balance = [1, 0.5, 1]"))
        points = ply(client.call("scan", colour=True, ambient=True)[1])
        painted = (colours(points) != 255).any(axis=1)
        colour = (self.seen_by_texture(points)[1] - [10, 20, 30]) * [1, 0.5, 1]
        self.assertLess(np.abs(colours(points) - colour)[painted].max(), 2)

    def test_a_texture_camera_is_asked_for_colours_alone(self):
        service = self.serve_texture()
        client = self.client_of(service)
        self.assertIn('use = "texture"', self.refused(client, INVALID_ARGUMENT, camera="texture", picture=True))
        with self.assertRaises(RpcError) as raised:
            client.call("preview", camera="texture")
        self.assertIn("request its frame", str(raised.exception))
        self.assertEqual(client.call("frame", camera="texture")[0]["width_px"], WIDTH)
        self.assertGreater(client.call("scan", texture=True)[0]["points"], 1000)  # without its white frame
        with self.assertRaises(RpcError) as raised:
            client.call("scan", colour=True)
        self.assertIn('folder "white"', str(raised.exception))
        self.record_texture("white", gradient(WIDTH, HEIGHT)[:, :, 1])
        status = client.call("status")[0]
        self.assertEqual([camera["name"] for camera in status["cameras"]], ["camera", "texture"])
        self.assertIsNotNone(status["cameras"][0]["calibration"])
        self.assertIsNone(status["cameras"][1]["calibration"])
        cameras = client.call("settings")[0]["cameras"]
        self.assertEqual([camera.get("use") for camera in cameras], [None, "texture"])
        service.stop()
        grey = self.client_of(service)
        self.assertIn("its frames have none", self.refused(grey, UNSUPPORTED, colour=True))

    def test_recordings_and_bundles_need_no_texture_camera(self):
        self.record_texture("white", gradient(WIDTH, HEIGHT))
        service = self.serve_texture(server="[black_box]\nmemory_max_mb = 200\n")
        client = self.client_of(service)
        cloud = client.call("scan", colour=True)[1]
        self.assertGreater(len(ply(cloud)), 1000)
        client.call("scan", colour=True, density="pixels", box=[-200, -200, 1900, 200, 200, 2100])
        bundle, recording = service.folder / "bundle.tar", service.folder / "recording"
        made = slsctl("--socket", service.socket, "bundle", "-o", bundle)
        self.assertEqual(made.returncode, 0, made.stderr)
        replayed = slsd("--replay", bundle)
        self.assertEqual(replayed.returncode, 0, replayed.stdout + replayed.stderr)
        self.assertEqual(replayed.stdout.count("byte for byte"), 2, replayed.stdout)
        recorded = slsctl("--socket", service.socket, "record", recording, "--frames", "2", "--clouds")
        self.assertEqual(recorded.returncode, 0, recorded.stderr)
        self.assertFalse((recording / "texture").exists())
        checked = slsd("--check", "--config", service.file)
        self.assertEqual(checked.returncode, 0, checked.stdout)
        self.assertIn('camera "texture"', checked.stdout)

    def test_a_texture_camera_must_be_calibrated(self):
        service = self.serve_texture(calibrated=False)
        refused = slsd("--check-config", "--config", service.file)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("calibrate them all", refused.stderr)

    def test_what_has_no_colour_is_refused(self):
        self.record("white", self.picture[:, :, 1])
        service, client = self.serve()
        self.assertIn("no camera sends colour", self.refused(client, UNSUPPORTED, colour=True))
        self.assertIn("leave out", self.refused(client, INVALID_PARAMS, colour=True, texture=False))
        refused = slsctl("--socket", service.socket, "scan", "--colour")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("no camera sends colour", refused.stderr)
        self.assertGreater(client.call("scan", texture=True)[0]["points"], 1000)


if __name__ == "__main__":
    unittest.main()
