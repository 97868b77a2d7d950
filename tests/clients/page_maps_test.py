#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The page's maps, what it says of the point under the cursor, and its distances, against numpy on the service's own files."""
import os
import pathlib
import re
import shutil
import tempfile
import unittest

import numpy as np

from browser import Browser, is_there
from page_service import CONFIGURATION, Web, downloaded
from service import SCENE, Service

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
CAN_SCAN = "!document.getElementById('scan').disabled"
NEAR, FAR = (252, 216, 104), (92, 84, 166)  # of picture/depth_colour.cpp


def pixels_of(pcd):
    """x, y, z, sigma of each pixel, row by row, by the header's own words."""
    head, records = pcd.split(b"DATA binary\n", 1)
    words = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if not line.startswith("#") and line}
    fields = np.dtype([(name, f"<{kind.lower()}{size}") for name, kind, size in zip(words["FIELDS"], words["TYPE"], words["SIZE"])])
    return np.frombuffer(records, fields).reshape(int(words["HEIGHT"][0]), int(words["WIDTH"][0]))


def symbols_of(ply):
    head, records = ply.split(b"end_header\n", 1)
    fields = [line.split()[1:] for line in head.decode().splitlines() if line.startswith("property")]
    return np.frombuffer(records, [(name, {"float": "<f4", "uchar": "u1", "int": "<i4"}[kind]) for kind, name in fields])


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Maps(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))

    def choose(self, browser, name, value):
        browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                    "c.dispatchEvent(new Event('change'));", name, value)

    def scan(self, browser, density):
        self.choose(browser, "density", density)
        browser.run("window.before = shownScan && shownScan.scan;")
        browser.click("#scan")
        browser.wait("shownScan && shownScan.scan !== window.before && !document.getElementById('scan').disabled", "no cloud")

    def open(self, browser, web, width=1600, height=1300):
        browser.resize(width, height)
        browser.open(web.address)
        browser.wait(CAN_SCAN, "nothing to draw clouds with")
        browser.wait("document.getElementById('which-camera').value === 'camera'", "no camera")

    def at_pixel(self, browser, kind, u, v, place="#map"):
        """Moves or presses the mouse at a pixel of the map."""
        browser.run("""
            const [kind, u, v, name] = arguments, map = document.querySelector(name), place = map.getBoundingClientRect();
            const where = {clientX: place.left + (u + 0.5) / map.width * place.width,
                           clientY: place.top + (v + 0.5) / map.height * place.height, bubbles: true};
            for (const each of kind) map.dispatchEvent(new PointerEvent(each, where));""", kind, u, v, place)

    def read(self, browser, u, v):
        browser.run("document.getElementById('under-cursor').textContent = '';")
        self.at_pixel(browser, ["pointermove"], u, v)
        return browser.wait("document.getElementById('under-cursor').textContent", "nothing under the cursor")

    def numbers(self, text):
        return [float(number) for number in re.findall(r"-?\d+\.\d+", text)]

    def test_a_cloud_shows_the_colour_of_the_surface(self):
        frames, downloads = (pathlib.Path(tempfile.mkdtemp(prefix="slsd-test-", dir=self.folder)) for _ in range(2))
        shutil.copy(SCENE / "frame.png", frames)
        (frames / "white").mkdir()
        x, y = np.meshgrid(np.arange(1600), np.arange(1200))
        picture = np.stack([40 + x // 10, np.full_like(x, 120), 200 - y // 10], axis=2).astype(np.uint8)
        (frames / "white/0.ppm").write_bytes(b"P6 1600 1200 255\n" + picture.tobytes())
        with Service(camera_path=frames) as service, Web(service) as web, Browser(downloads) as browser, service.client() as client:
            service.wait_ready()
            self.open(browser, web)
            self.scan(browser, "symbols")
            self.choose(browser, "colour", "own")
            self.assertIn("press Scan", browser.run("return document.getElementById('scale').textContent;"))
            for density in ("symbols", "pixels"):
                self.scan(browser, density)
                self.assertIn("colour of the surface", browser.run("return document.getElementById('scale').textContent;"))
                drawn, has = browser.run("""
                    const drawn = view.points.geometry.getAttribute("colour").array, all = [[], []];
                    ["red", "green", "blue"].forEach((name, c) => column(view.ply, name).forEach((level, i) => {
                      if (i % 97 === 0) all[0].push(drawn[4 * i + c]), all[1].push(level); }));
                    return all;""")
                self.assertEqual(drawn, has)
                browser.picture(self.folder / f"own-colour-{density}.png")
                browser.click("#save-pcd")
                file = downloaded(downloads, "*.pcd", 1 if density == "symbols" else 2)[-1].read_bytes()
                expected = client.call("scan", colour=True, density=density, format="pcd")[1]
                self.assertIn(b" rgb\n", file.split(b"DATA")[0])
                shown, own = pixels_of(file), pixels_of(expected)
                np.testing.assert_array_equal(shown["x"], own["x"])
                np.testing.assert_array_equal(*(np.ascontiguousarray(each["rgb"]).view("<u4") for each in (shown, own)))

    def test_a_dense_map_says_what_the_file_has_at_each_pixel(self):
        with Service(configuration=CONFIGURATION) as service, Web(service) as web, Browser() as browser, service.client() as client:
            service.wait_ready()
            self.open(browser, web)
            self.scan(browser, "pixels")
            cloud = pixels_of(client.call("scan", format="pcd", density="pixels", timeout_ms=600000)[1])
            measured = np.argwhere(~np.isnan(cloud["z"]))
            empty = np.argwhere(np.isnan(cloud["z"]))
            self.choose(browser, "shown-as", "z")
            browser.wait("!document.getElementById('map').hidden && map.records", "no map")
            self.assertEqual(browser.run("return [map.canvas.width, map.canvas.height];"), list(cloud.shape[::-1]))
            for v, u in measured[:: len(measured) // 7].tolist():
                text = self.read(browser, u, v)
                point = cloud[v, u]
                self.assertTrue(text.startswith(f"px {u}, {v}: x "), text)
                np.testing.assert_allclose(self.numbers(text), [point["x"], point["y"], point["z"], point["sigma_mm"]], atol=0.006)
            v, u = empty[len(empty) // 2].tolist()
            self.assertEqual(self.read(browser, u, v), f"px {u}, {v}: no point here")
            browser.picture(self.folder / "map-depth-1600.png")
            self.check_colours(browser, cloud["z"])
            self.choose(browser, "shown-as", "sigma_mm")
            self.assertIn("mm of sigma", browser.run("return document.getElementById('scale').textContent;"))
            self.check_colours(browser, cloud["sigma_mm"])
            browser.picture(self.folder / "map-sigma-1600.png")
            browser.resize(390, 844)
            browser.click("nav [data-view=cloud]")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            self.assertEqual(browser.complaints(), [])

    def check_colours(self, browser, values):
        """The hundredth of the lowest is gold, that of the highest indigo, and what has no point is neither."""
        drawn = browser.run("""
            const {width, height} = map.canvas, data = map.canvas.getContext('2d').getImageData(0, 0, width, height).data;
            return arguments[0].map(([v, u]) => [...data.slice(4 * (v * width + u), 4 * (v * width + u) + 3)]);""",
                            [np.argwhere(values <= np.nanquantile(values, 0.005))[0].tolist(),
                             np.argwhere(values >= np.nanquantile(values, 0.995))[0].tolist(), np.argwhere(np.isnan(values))[0].tolist()])
        self.assertEqual(drawn, [list(NEAR), list(FAR), [0x22, 0x26, 0x2c]])

    def test_a_symbol_fills_the_map_around_it_and_clipping_is_red(self):
        with Service() as service, Web(service) as web, Browser() as browser, service.client() as client:
            service.wait_ready()
            self.open(browser, web)
            self.scan(browser, "symbols")
            self.choose(browser, "shown-as", "z")
            browser.wait("map.records", "no map")
            cloud = symbols_of(client.call("scan", format="ply")[1])
            for point in cloud[:: len(cloud) // 5]:
                u, v = round(float(point["camera_u"])), round(float(point["camera_v"]))
                text = self.read(browser, u + 2, v - 2)
                np.testing.assert_allclose(self.numbers(text)[:3], [point["x"], point["y"], point["z"]], atol=0.006)
            self.choose(browser, "shown-as", "clipping")
            browser.wait("/% of the frame/.test(document.getElementById('scale').textContent)", "no map of clipping")
            self.assertEqual(browser.run("""
                const frame = {width: 8, height: 2, grey: new Uint8Array(16).fill(100)};
                frame.grey[3] = 255;
                const part = map.drawClipping(frame).clipped, pixels = map.canvas.getContext('2d').getImageData(0, 0, 8, 2).data;
                return [part, ...pixels.slice(12, 16), ...pixels.slice(16, 20)];"""), [1 / 16, 255, 0, 0, 255, 100, 100, 100, 255])

    def live(self, browser, wanted):
        if browser.run("return document.getElementById('cloud-live').checked;") != wanted:
            browser.click("#cloud-live")

    def test_maps_follow_live_clouds_of_pixels(self):
        with Service(configuration=CONFIGURATION) as service, Web(service) as web, tempfile.TemporaryDirectory() as downloads, \
                Browser(downloads) as browser, service.client() as client:
            service.wait_ready()
            self.open(browser, web)
            self.choose(browser, "density", "pixels")
            self.live(browser, True)
            browser.wait("view.ply && view.ply.count > 10000", "no live cloud")
            self.choose(browser, "shown-as", "z")
            browser.wait("Boolean(map.records)", "no map")
            cloud = pixels_of(client.call("scan", format="pcd", density="pixels", timeout_ms=600000)[1])
            measured = np.argwhere(~np.isnan(cloud["z"]))
            v, u = measured[len(measured) // 2].tolist()
            text = self.read(browser, u, v)  # and without a move of the mouse, it follows the next clouds
            browser.run("document.getElementById('under-cursor').textContent = '';")
            number = browser.run("return shownScan.number;")
            browser.wait(f"shownScan.number > {number} && document.getElementById('under-cursor').textContent", "it does not follow")
            self.assertTrue(text.startswith(f"px {u}, {v}: x "), text)
            np.testing.assert_allclose(self.numbers(text)[:3], [cloud[v, u][each] for each in "xyz"], atol=1)
            for kind, words in (("sigma_mm", "mm of sigma"), ("z", "mm of depth")):
                self.choose(browser, "shown-as", kind)
                number = browser.run("return shownScan.number;")
                browser.wait(f"shownScan.number > {number} && document.getElementById('scale').textContent.includes('{words}')", "no map")
            self.assertTrue(browser.run("return document.getElementById('message').hidden;"))
            browser.picture(self.folder / "map-live-1600.png")
            self.live(browser, False)
            browser.click("#save-pcd")  # what is on the map is what came
            shown = pixels_of(downloaded(downloads, "*.pcd")[0].read_bytes())
            self.assertEqual(browser.run("return [map.canvas.width, map.canvas.height];"), list(shown.shape[::-1]))
            self.check_colours(browser, shown["z"])
            for v, u in np.argwhere(~np.isnan(shown["z"]))[:: len(measured) // 5].tolist():
                point = shown[v, u]
                np.testing.assert_allclose(self.numbers(self.read(browser, u, v)),
                                           [point["x"], point["y"], point["z"], point["sigma_mm"]], atol=0.006)
            browser.resize(390, 844)
            browser.click("nav [data-view=cloud]")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            self.assertEqual(browser.complaints(), [])

    def test_the_newest_live_cloud_wins_and_frames_of_clipping_are_few(self):
        with Service(configuration=CONFIGURATION) as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web)
            browser.run("""
                window.shown = [], window.frames = [], window.under = 0, window.slow = 700;
                const show = showCloud, frame = askFrame;
                showCloud = (buffer, about) => {
                  window.shown.push(about.number);
                  for (const end = performance.now() + window.slow; performance.now() < end;) ;  // slower than the clouds come
                  show(buffer, about);
                };
                askFrame = async (...asked) => {
                  window.frames.push([performance.now(), ++window.under]);
                  try { return await frame(...asked); } finally { --window.under; }
                };""")
            self.choose(browser, "density", "symbols")
            self.live(browser, True)
            browser.wait("Boolean(view.ply)", "no live cloud")
            self.choose(browser, "shown-as", "clipping")
            browser.wait("/% of the frame/.test(document.getElementById('scale').textContent)", "no map of clipping")
            browser.wait("window.shown.length >= 6 && window.frames.length >= 2", "no more clouds")
            shown, frames = browser.run("return [window.shown, window.frames];")
            self.assertGreater(max(np.diff(shown)), 1)  # some were left out
            self.assertEqual({under for _, under in frames}, {1})
            self.assertGreaterEqual(min(np.diff([asked for asked, _ in frames])), 1000)
            browser.run("window.slow = 0;")
            for density, symbols in (("symbols", "true"), ("pixels", "false")):
                self.choose(browser, "density", density)
                number = browser.run("return shownScan.scan;")
                browser.wait(f"shownScan.scan !== '{number}' && Boolean(view.ply.fields.symbol) === {symbols} && Boolean(map.records) && "
                             "Boolean(clipped) && map.canvas.width === clipped.frame.width", "no map of clipping")
                self.read(browser, 10, 10)
            self.live(browser, False)
            browser.wait("clipped && clipped.scan === shownScan", "the last cloud has an older frame")
            self.assertEqual(browser.complaints(), [])

    def test_a_cloud_of_pixels_that_was_live_in_space_has_no_map_and_the_page_says_so(self):
        with Service(configuration=CONFIGURATION) as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            self.open(browser, web)
            self.choose(browser, "density", "pixels")
            browser.click("#cloud-live")
            browser.wait("view.ply && view.ply.count > 10000", "no live cloud")
            browser.click("#cloud-live")
            self.choose(browser, "shown-as", "z")
            browser.wait("/Press Scan for a map/.test(document.getElementById('message').textContent)", "no message")
            self.assertEqual(browser.run("return [document.getElementById('shown-as').value, document.getElementById('space').hidden];"),
                             ["space", False])
            self.scan(browser, "pixels")
            self.choose(browser, "shown-as", "z")
            browser.wait("map.records && document.getElementById('message').hidden", "the complaint stays")

    def test_several_distances_agree_with_numpy_on_both_views(self):
        with Service(configuration=CONFIGURATION) as service, Web(service) as web, Browser() as browser, service.client() as client:
            service.wait_ready()
            self.open(browser, web)
            self.scan(browser, "pixels")
            cloud = pixels_of(client.call("scan", format="pcd", density="pixels", timeout_ms=600000)[1])
            measured = np.argwhere(~np.isnan(cloud["z"]))
            picks = measured[[len(measured) // 9 * i + 40 for i in range(1, 7)]].tolist()
            self.choose(browser, "shown-as", "z")
            browser.wait("map.records", "no map")
            for v, u in picks:
                self.at_pixel(browser, ["pointerdown", "pointerup"], u, v)
            rows = browser.run("return [...document.querySelectorAll('#distances tbody tr')]"
                               ".map((row) => [...row.querySelectorAll('td')].slice(0, 5).map((cell) => Number(cell.textContent)));")
            self.assertEqual(len(rows), 3)
            for row, (first, second) in zip(rows, zip(picks[::2], picks[1::2])):
                a, b = (cloud[tuple(pick)] for pick in (first, second))
                places = [np.array([p["x"], p["y"], p["z"]], float) for p in (a, b)]
                between = places[1] - places[0]
                along = [p["sigma_mm"] * abs(place @ between) / np.linalg.norm(place) / np.linalg.norm(between)
                         for p, place in zip((a, b), places)]
                np.testing.assert_allclose(row, [np.linalg.norm(between), np.hypot(*along), *between], atol=0.0051)
            browser.picture(self.folder / "distances-map-1600.png")
            self.choose(browser, "shown-as", "space")
            lines = browser.run("return view.marks.children.filter((m) => m.isLine).map((m) => "
                                "[...m.geometry.getAttribute('position').array]);")
            np.testing.assert_allclose(np.linalg.norm(np.diff(np.reshape(lines, (3, 2, 3)), axis=1), axis=2).ravel(),
                                       [row[0] for row in rows], atol=0.0051)
            browser.picture(self.folder / "distances-space-1600.png")
            browser.click("#distances tbody tr:nth-child(2) button")
            self.assertEqual(browser.run("return [measurements.distances.length, view.marks.children.length];"), [2, 6])
            browser.resize(390, 844)
            browser.click("nav [data-view=cloud]")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            browser.picture(self.folder / "distances-390.png")
            browser.key("x")
            self.assertEqual(browser.run("return [measurements.distances.length, view.marks.children.length, "
                                         "document.getElementById('distances').hidden];"), [0, 0, True])
            self.scan(browser, "symbols")  # a point in space is the one whose record it names
            browser.resize(1600, 1300)
            same = browser.run("""
                const at = view.points.geometry.getAttribute('position').array;
                const n = view.ply.count;
                return [0, 1, Math.floor(0.3 * n), Math.floor(0.8 * n), n - 1].map((i) => {
                  const [x, y, z] = pointOf(view.ply, recordOf(i, view.ply.count)).at;
                  return x === at[3 * i] && y === -at[3 * i + 1] && z === -at[3 * i + 2];
                });""")
            self.assertEqual(same, [True] * 5)
            self.assertEqual(browser.complaints(), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
