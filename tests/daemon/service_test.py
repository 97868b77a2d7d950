#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The whole service from outside: scans, and faults of the camera."""
import fcntl
import pathlib
import socket
import tempfile
import threading
import unittest

from client import RpcError
from point_cloud import vertices
from service import SCENE, Service, slsd, wait_until

F_GET_SEALS = 1034
ALL_SEALS = 0xF


class Scan(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = Service().start()

    @classmethod
    def tearDownClass(cls):
        cls.service.__exit__()

    def test_gives_the_plane_as_ply(self):
        with self.service.client() as client:
            result, cloud = client.call("scan", format="ply")
        points = vertices(cloud)
        self.assertEqual(len(points), result["points"])
        self.assertGreater(len(points), 2000)
        self.assertTrue(all(abs(z - 2000) < 20 for _, _, z in points))

    def test_tells_the_light_of_each_camera(self):
        with self.service.client() as client:
            light = client.call("scan")[0]["light"]
            client.call("subscribe")
            streamed = client.receive()[0]["params"]["light"]
        self.assertEqual(list(light), ["camera"])
        self.assertEqual(light["camera"]["clipped_share"], 0)
        self.assertTrue(0.5 < light["camera"]["edge_px"] < 1.5, light)
        self.assertEqual(streamed, light)

    def test_gives_pcd_and_names_each_scan(self):
        with self.service.client() as client:
            first, cloud = client.call("scan", format="pcd")
            second, _ = client.call("scan")
        self.assertTrue(cloud.startswith(b"# .PCD"))
        self.assertNotEqual(first["scan"], second["scan"])
        self.assertGreater(second["frame"], first["frame"])

    def test_serves_several_clients_at_once(self):
        scans, problems = [], []

        def work():
            try:
                with self.service.client() as client:
                    for _ in range(5):
                        scans.append(client.call("scan", timeout_ms=600000)[0]["scan"])
            except Exception as problem:  # pylint: disable=broad-except
                problems.append(problem)

        threads = [threading.Thread(target=work) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(problems, [])
        self.assertEqual(len(set(scans)), 30)

    def test_hands_over_a_sealed_memfd(self):
        with self.service.client() as client:
            inline, cloud = client.call("scan")
            result, memory = client.call_for_descriptor("scan", transport="memfd")
            with memory:
                content = memory.read()
                self.assertEqual(fcntl.fcntl(memory, F_GET_SEALS), ALL_SEALS)
        self.assertNotIn("bytes", result)
        self.assertEqual(result["memfd_bytes"], len(content))
        self.assertEqual(inline["points"], result["points"])
        self.assertEqual(vertices(content), vertices(cloud))

    def test_sends_a_picture_before_the_reply(self):
        with self.service.client() as client:
            result, _ = client.call("scan", picture=True)
            (event, picture), = client.events
        self.assertEqual(event["params"]["scan"], result["scan"])
        self.assertTrue(picture.startswith(b"\x89PNG"))

    def test_gives_the_frame_the_pattern_and_a_preview(self):
        with self.service.client() as client:
            raw, pixels = client.call("frame", format="raw")
            _, frame = client.call("frame")
            _, pattern = client.call("pattern")
            _, preview = client.call("preview")
        self.assertEqual((raw["width_px"], raw["height_px"], raw["bits"]), (1600, 1200, 8))
        self.assertEqual(len(pixels), 1600 * 1200)
        for png in (frame, preview):
            self.assertTrue(png.startswith(b"\x89PNG"))
        file = self.service.folder / "pattern.png"
        self.assertEqual(slsd("--pattern", file, "--config", self.service.file).returncode, 0)
        self.assertEqual(file.read_bytes(), pattern)

    def test_tells_its_state(self):
        with self.service.client() as client:
            client.call("scan")
            status, _ = client.call("status")
        self.assertTrue(status["ready"])
        self.assertEqual(status["cameras"][0]["state"], "ready")
        calibration = status["cameras"][0]["calibration"]
        self.assertGreater(calibration["scans"], 0)
        self.assertIsNone(calibration["off_since_scan"])
        self.assertLess(calibration["epipolar_px"], calibration["limit_px"])
        self.assertGreater(status["scans"]["succeeded"], 0)
        self.assertGreater(status["scans"]["regions"]["decoded"], 2000)
        self.assertGreater(status["scans"]["stages_ms"]["describe"]["mean"], 0)

    def test_answers_half_closed_connections(self):
        with self.service.client() as client:
            client.send(b'{"jsonrpc":"2.0","id":1,"method":"status"}')
            client.socket.shutdown(socket.SHUT_WR)
            message, _ = client.receive()
            self.assertIn("result", message)
            self.assertEqual(client.socket.recv(1), b"")

    def test_refuses_what_could_be_meant_in_two_ways(self):
        with self.service.client() as client:
            for params, word in (('{"format":"ply","format":"pcd"}', "twice"), ('{"preset":""}', "preset"), ('{"camera":""}', "camera"),
                                 ('{"poses":"ur"}', "robot_pose")):
                client.last_id = 7
                client.send(b'{"jsonrpc":"2.0","id":7,"method":"scan","params":%s}\n' % params.encode())
                with self.assertRaises(RpcError) as refused:
                    client.reply()
                self.assertIn(refused.exception.name, ("invalid_request", "invalid_params"))
                self.assertIn(word, str(refused.exception))

    def test_refuses_wrong_parameters_with_a_hint(self):
        wrong = [("scan", {"formatt": "ply"}, "did you mean format?"), ("scan", {"format": "xyz"}, "ply"),
                 ("scan", {"timeout_ms": 0}, "1 to 600000"), ("scan", {"timeout_ms": 1e99}, "1 to 600000"),
                 ("scan", {"timeout_ms": 2**70}, "1 to 600000"), ("scan", {"picture": 1}, "true or false"),
                 ("subscribe", {"rate_hz": 1e-300}, "0.001 to 1000"), ("frame", {"camera": 7}, "a string"),
                 ("status", {"verbose": True}, "no such parameter")]
        with self.service.client() as client:
            for method, params, hint in wrong:
                with self.subTest(params=params), self.assertRaises(RpcError) as caught:
                    client.call(method, **params)
                self.assertEqual(caught.exception.code, -32602)
                self.assertIn(hint, str(caught.exception))
            with self.assertRaises(RpcError) as caught:
                client.call("frame", camera="right")
            self.assertEqual(caught.exception.name, "not_found")
            with self.assertRaises(RpcError) as caught:
                client.call("scann")
            self.assertEqual(caught.exception.code, -32601)
            self.assertIn("did you mean scan?", str(caught.exception))


class Faults(unittest.TestCase):
    def expect(self, faults, name, **params):
        """The first scan fails with the name, and the one after it succeeds."""
        with Service(camera=f"faults = {faults}") as service, service.client() as client:
            service.wait_ready()
            with self.assertRaises(RpcError) as caught:
                client.call("scan", **params)
            self.assertEqual(caught.exception.name, name, str(caught.exception))
            result, cloud = client.call("scan")
            self.assertEqual(len(vertices(cloud)), result["points"])
            status = client.call("status")[0]["scans"]
            self.assertEqual(status["failed"], {name: 1})
            self.assertEqual(status["last_error"]["data"]["name"], name)

    def test_each_has_a_name(self):
        for fault, name, params in [("disconnect@1", "disconnected", {}),
                                    ("late@1", "frame_late", {"timeout_ms": 1500})]:
            with self.subTest(fault=fault):
                self.expect([fault], name, **params)

    def test_disconnected_camera_comes_back_by_itself(self):
        with Service(camera='faults = ["disconnect@2:500ms"]') as service, service.client() as client:
            client.call("scan")
            with self.assertRaises(RpcError):
                client.call("scan")
            client.call("scan")
            log = service.log_text()
            self.assertEqual(log.count("trying again until it opens"), 1)
            self.assertEqual(log.count("open again"), 1)

    def test_scan_waits_for_a_camera_that_is_still_missing(self):
        with tempfile.TemporaryDirectory() as folder:
            frame = pathlib.Path(folder) / "frame.png"
            with Service(camera_path=frame) as service, service.client() as client:
                with self.assertRaises(RpcError) as caught:
                    client.call("scan", timeout_ms=200)
                self.assertEqual(caught.exception.name, "timeout")
                client.request("scan", timeout_ms=600000)
                part = frame.with_suffix(".part")
                part.write_bytes((SCENE / "frame.png").read_bytes())
                part.rename(frame)
                self.assertGreater(client.reply()[0]["points"], 2000)

    def test_frames_without_a_pattern_give_an_empty_cloud(self):
        for image in ("black.png", "white.png"):
            with Service(camera_path=SCENE / image) as service, service.client() as client:
                result, cloud = client.call("scan")
                self.assertEqual((result["points"], vertices(cloud)), (0, []))
                self.assertEqual(result["light"], {"camera": {}})

    def test_frame_of_another_size_is_an_error(self):
        with Service(camera_path=SCENE / "small.png") as service, service.client() as client:
            with self.assertRaises(RpcError) as caught:
                client.call("scan")
            self.assertEqual(caught.exception.name, "mismatch")
            self.assertIn("640x480", str(caught.exception))

    def test_images_of_another_size_open_the_camera_again(self):
        with tempfile.TemporaryDirectory() as folder:
            frame = pathlib.Path(folder) / "frame.png"

            def put(image):
                part = frame.with_suffix(".part")
                part.write_bytes((SCENE / image).read_bytes())
                part.rename(frame)
            put("frame.png")
            with Service(camera_path=folder) as service, service.client() as client:
                client.call("scan")
                for image, size in (("small.png", 640), ("frame.png", 1600)):
                    put(image)
                    with self.assertRaises(RpcError) as caught:
                        client.call("scan")
                    self.assertEqual(caught.exception.name, "disconnected")
                    self.assertIn("other images replaced", str(caught.exception))
                    wait_until(lambda: client.call("status")[0]["ready"], "the camera")
                    self.assertEqual(client.call("status")[0]["cameras"][0]["width_px"], size)
                self.assertGreater(client.call("scan")[0]["points"], 2000)


if __name__ == "__main__":
    unittest.main(verbosity=2)
