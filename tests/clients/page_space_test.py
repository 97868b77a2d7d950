#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The cloud in space: its light against the service's own normals, its axes and scale, the depths that are shown, and how far a
scan is."""
import os
import pathlib
import tempfile
import unittest

import numpy as np

from browser import Browser, is_there
from page_service import CONFIGURATION, Web
from service import Service

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
HAND_EYE = """%YAML:1.0
---
mounted: "cell"
base_from_rig_R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
base_from_rig_T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ 0., 0., 5000. ]
"""
CAN_SCAN = "!document.getElementById('scan').disabled"
# The share of the view's middle that shows the background.
GAPS = """
view.drawnAt = -Infinity;  // whole, not the part of a view that turns
view.render(performance.now());
const gl = view.renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], all = new Uint8Array(4 * w * h);
gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, all);
let gaps = 0, looked = 0;
for (let y = Math.floor(0.3 * h); y < 0.7 * h; ++y) {
  for (let x = Math.floor(0.3 * w); x < 0.7 * w; ++x, ++looked) {
    const i = 4 * (y * w + x);
    gaps += all[i] === 0x16 && all[i + 1] === 0x18 && all[i + 2] === 0x1c;
  }
}
return gaps / looked;"""


def points_of(pcd):
    """The measured pixels, row by row."""
    head, records = pcd.split(b"DATA binary\n", 1)
    words = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if not line.startswith("#") and line}
    fields = np.dtype([(name, f"<{kind.lower()}{size}") for name, kind, size in zip(words["FIELDS"], words["TYPE"], words["SIZE"])])
    cloud = np.frombuffer(records, fields)
    return cloud[~np.isnan(cloud["z"])]


def lit(normals):
    """As --cloud-picture has it: picture/cloud/relief.cpp."""
    light = np.array([-0.30, -0.62, -0.72]) / np.linalg.norm([-0.30, -0.62, -0.72])
    return 0.42 + 0.66 * np.maximum(0, normals @ light)


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Space(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))
        self.service = self.enterContext(Service(configuration=CONFIGURATION))
        self.web = self.enterContext(Web(self.service))
        self.browser = self.enterContext(Browser())
        self.service.wait_ready()

    def open(self, width=1600, height=1300, scheme="light"):
        self.browser.resize(width, height)
        self.browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.browser.open("about:blank")  # the page before asks with its own session until it is gone
        self.browser.open(self.web.address)
        self.browser.wait(CAN_SCAN, "nothing to draw clouds with")
        if width < 1100:
            self.browser.click("nav [data-view=cloud]")

    def choose(self, name, value, event="change"):
        self.browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                         "c.dispatchEvent(new Event(arguments[2]));", name, value, event)

    def scan(self, density):
        self.choose("density", density)
        self.browser.run("window.before = shownScan && shownScan.scan;")
        self.browser.click("#scan")
        self.browser.wait("shownScan && shownScan.scan !== window.before && !document.getElementById('scan').disabled", "no cloud")

    def turn(self, around_x, around_y, nearer=1.0):
        self.browser.run("""
            const [x, y, nearer] = arguments, target = view.controls.target, from = view.camera.position.clone().sub(target);
            from.applyAxisAngle(new THREE.Vector3(0, 1, 0), y).applyAxisAngle(new THREE.Vector3(1, 0, 0), x).multiplyScalar(nearer);
            view.camera.position.copy(from.add(target));
            view.controls.update();
            view.drawnAt = -Infinity;
            view.render(performance.now());""", around_x, around_y, nearer)

    def test_the_light_is_that_of_the_services_own_normals(self):
        with self.service.client() as client:
            self.open()
            self.scan("pixels")
            points = points_of(client.call("scan", format="pcd", density="pixels", normals=True, timeout_ms=600000)[1])
            count = self.browser.run("return view.ply.count;")
            self.assertEqual(len(points), count)
            normals = np.stack([points[f"normal_{axis}"] for axis in "xyz"], 1)
            bright = np.array(self.browser.run("return [...view.ply.shade.bright];"), float) / 255 * 1.08
            known = ~np.isnan(normals[:, 0])
            off = np.abs(bright - lit(normals))[known]
            print(f"brightness off that of the service's normals: median {np.median(off):.3f}, 90 % within {np.quantile(off, 0.9):.3f}")
            self.assertLess(np.median(off), 0.02)
            self.assertLess(np.quantile(off, 0.9), 0.1)
            self.assertGreater(np.corrcoef(bright[known], lit(normals)[known])[0, 1], 0.9)
            plain = "view.shaded = arguments[0]; view.paint(); return [...view.points.geometry.getAttribute('colour').array.slice(0, 4000)];"
            shaded, flat = self.browser.run(plain, True), self.browser.run(plain, False)
            self.assertNotEqual(shaded, flat)
            stops = [(252, 216, 104), (204, 212, 102), (124, 198, 126), (64, 174, 152), (52, 146, 176), (72, 116, 182), (92, 84, 166)]
            low, high = self.browser.run("return view.range;")
            depths = np.array(self.browser.run("return [...column(view.ply, 'z').slice(0, 1000)];"))
            shares = np.rint(255 * np.clip((depths - low) / (high - low), 0, 1)) / 255
            expected = np.stack([np.interp(6 * shares, range(7), [stop[c] for stop in stops]) for c in range(3)], 1)
            np.testing.assert_allclose(np.reshape(flat, (-1, 4))[:, :3], expected, atol=1.01)

    def test_axes_and_scale_are_true(self):
        for width, height, scheme in ((1600, 1300, "light"), (1280, 900, "dark"), (390, 844, "dark")):
            self.open(width, height, scheme)
            self.scan("pixels")
            self.assertEqual(self.browser.run("return view.boxLines[0].geometry.getAttribute('position').count;"), 24)
            self.turn(-0.35, -0.5)
            texts = self.browser.run("""
                const texts = [], write = overlay.write;
                overlay.write = (context, text, x, y) => texts.push([text, x, y]);
                overlay.draw();
                overlay.write = write;
                overlay.draw();
                return texts;""")
            names = [text for text, _, _ in texts]
            for axis in "xyz":
                self.assertIn(f"{axis} mm", names)
            self.assertGreaterEqual(len(names), 3 + 1 + 6)
            # A bar of its length amid the view, across the line of sight, is as long on the screen.
            mm, px, seen = self.browser.run("""
                const across = new THREE.Vector3(1, 0, 0).applyQuaternion(view.camera.quaternion), target = view.controls.target;
                const ends = [-0.5, 0.5].map((share) => {
                  const p = across.clone().multiplyScalar(share * overlay.bar.mm).add(target);
                  return overlay.onScreen([p.x, -p.y, -p.z]);
                });
                return [overlay.bar.mm, overlay.bar.px, Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1])];""")
            self.assertAlmostEqual(px, seen, delta=0.01 * px)
            self.assertIn(f"{mm} mm", names)
            self.browser.picture(self.folder / f"space-{scheme}-{width}.png")
            self.assertLessEqual(self.browser.run("return document.documentElement.scrollWidth;"), width)
            self.browser.click("#whole")
            self.assertEqual(self.browser.complaints(), [])

    def test_a_surface_has_no_gaps_at_any_zoom(self):
        """A wall without holes."""
        with Service() as service, Web(service) as web:
            service.wait_ready()
            self.web = web
            self.open()
            self.scan("pixels")
            for nearer in (1, 0.4, 0.4):
                self.turn(0.1, 0.2, nearer)
                self.browser.picture(self.folder / f"gaps-{nearer}.png")
                self.assertLess(self.browser.run(GAPS), 0.002, nearer)

    def test_only_chosen_depths_are_shown_and_picked(self):
        self.open()
        self.scan("pixels")
        hidden = """
            const colours = view.points.geometry.getAttribute('colour').array, depths = column(view.ply, 'z');
            const [near, far] = depthLimits || [-Infinity, Infinity];
            let wrong = 0, out = 0;
            for (let i = 0; i < depths.length; ++i) {
              const is_out = depths[i] < near || depths[i] > far;
              out += is_out;
              wrong += (colours[4 * i + 3] === 0) !== is_out;
            }
            return [wrong, out > 0.2 * depths.length, out < 0.99 * depths.length];"""
        self.assertEqual(self.browser.run(hidden), [0, False, True])
        self.choose("far", 500, "input")
        self.assertEqual(self.browser.run(hidden), [0, True, True])
        self.assertEqual(self.browser.run("return view.range[1] === depthLimits[1];"), True)
        picked = self.browser.run("""
            const {clientWidth: w, clientHeight: h} = view.place, found = [];
            for (let x = 0; x < w; x += 40) for (let y = 0; y < h; y += 40) found.push(view.recordAt(x, y));
            return found.filter((r) => r >= 0).map((r) => pointOf(view.ply, r).at[2] <= depthLimits[1]);""")
        self.assertEqual((len(picked) > 3, all(picked)), (True, True))
        self.choose("shown-as", "z")
        self.browser.wait("map.records", "no map")
        self.assertGreater(self.browser.run("""
            const {width, height} = map.canvas, p = new Uint32Array(map.canvas.getContext('2d').getImageData(0, 0, width, height).data.buffer);
            return p.filter((value, i) => value === kNoPoint && map.records.at[i] >= 0).length;"""), 1000)
        self.choose("near", 700, "input")  # beyond the far one, which makes room
        self.assertEqual(self.browser.run("return depthLimits[0] < depthLimits[1];"), True)
        self.browser.click("#all-depths")
        self.assertEqual(self.browser.run(hidden), [0, False, True])
        self.assertEqual(self.browser.complaints(), [])

    def drag(self, selector, begin, end):
        """From one pixel of a canvas to another."""
        places = self.browser.run("""
            const [name, ...pixels] = arguments, canvas = document.querySelector(name), place = canvas.getBoundingClientRect();
            return pixels.map(([u, v]) => [(u + 0.5) / canvas.width * place.width, (v + 0.5) / canvas.height * place.height]);""",
                                  selector, begin, end)
        self.browser.drag(selector, *places)

    def box(self):
        return self.browser.run("return partOfScan().box ?? null;")

    def test_a_box_is_drawn_on_the_map_and_measured_alone(self):
        with self.service.client() as client:
            self.open()
            self.browser.click("#box summary")
            self.browser.click("#box-draw")
            self.browser.wait("/Scan first/.test(document.getElementById('message').textContent)", "no word that a scan is needed")
            self.scan("pixels")
            whole = points_of(client.call("scan", format="pcd", density="pixels", timeout_ms=600000)[1])
            self.browser.click("#box-draw")
            self.browser.wait("drawsBox && map.records", "no map to draw on")
            self.drag("#map", (200, 120), (300, 220))  # the bust's face
            low, high = np.reshape(self.box(), (2, 3))
            self.assertEqual(self.browser.run("return [measurements.points().length, drawsBox, document.getElementById('rubber').hidden];"),
                             [0, False, True])
            place = np.stack([whole[axis] for axis in "xyz"], 1)
            inside = np.all((place >= low) & (place <= high), axis=1)
            self.assertTrue(4000 < inside.sum() < 20000, inside.sum())  # a hundred pixels aside
            self.assertLess(high[2], 2200)  # the wall is not in it
            self.browser.picture(self.folder / "box-map-1600.png")
            self.scan("pixels")
            self.assertAlmostEqual(self.browser.run("return view.ply.count;") / inside.sum(), 1, delta=0.02)
            self.choose("shown-as", "space")
            self.assertEqual(self.browser.run("return view.boxLines.length;"), 2)
            across = "const p = view.camera.position; return p.distanceTo(view.controls.target);"
            near = self.browser.run(across)
            self.browser.picture(self.folder / "box-space-1600.png")
            self.browser.click("#box-for-all")
            self.browser.wait("boxChosen === null", "it is not set")
            self.assertEqual(client.call("settings")[0]["set"]["cloud"], {"box": self.browser.run("return partOfService.box;")})
            self.browser.click("#box-whole")
            self.scan("pixels")
            self.assertEqual(self.browser.run("return view.ply.count;"), len(whole))
            self.assertLess(near, 0.5 * self.browser.run(across))  # the box filled the view
            client.call("set", cloud={"box": None})
            self.browser.wait("partOfService.box.length === 0", "the page does not follow")
            self.browser.resize(390, 844)
            self.browser.click("nav [data-view=cloud]")
            self.assertLessEqual(self.browser.run("return document.documentElement.scrollWidth;"), 390)
            self.browser.picture(self.folder / "box-390.png")
            self.assertEqual(self.browser.complaints(), [])

    def in_base(self, cloud):
        """A scanner in the robot's cell, whose base is 5 m behind the rig."""
        service = Service(configuration=CONFIGURATION + f'[frame]\nhand_eye = "hand_eye.yml"\n[cloud]\n{cloud}\nbox_frame = "robot_base"\n')
        (service.folder / "hand_eye.yml").write_text(HAND_EYE, encoding="utf-8")
        self.enterContext(service)
        self.web = self.enterContext(Web(service))
        service.wait_ready()
        self.open()
        self.browser.click("#box summary")
        return service

    def note(self):
        return self.browser.run("return document.getElementById('box-note').textContent;")

    def set_box(self, box):
        for name, value in zip(("x-from", "y-from", "z-from", "x-to", "y-to", "z-to"), box):
            self.choose(name, value)

    def test_a_plane_in_the_robots_base_keeps_its_frame(self):
        with self.service.client() as client:
            whole = points_of(client.call("scan", format="pcd", density="pixels", timeout_ms=600000)[1])
        middle = float(np.median(whole["z"]))
        service = self.in_base(f"plane = [0, 0, 1, {5000 + middle}]")  # in the rig's frame it would leave nothing
        self.browser.wait("planeIsInBase()", "no word of the plane")
        self.scan("pixels")
        beyond = np.count_nonzero(whole["z"] > middle)
        self.assertAlmostEqual(self.browser.run("return view.ply.count;") / beyond, 1, delta=0.02)
        self.set_box((-1000, -1000, middle - 300, 1000, 1000, middle + 300))
        self.assertRegex(self.note(), "cannot be kept for every scan: .* a plane is configured in the robot's base")
        self.assertTrue(self.browser.run("return document.getElementById('box-for-all').disabled;"))
        self.assertEqual(self.browser.run("return [partOfScan().box_frame, partOfScan().plane];"), ["rig", []])
        self.scan("pixels")
        inside = np.count_nonzero((abs(whole["x"]) <= 1000) & (abs(whole["y"]) <= 1000) & (abs(whole["z"] - middle) <= 300))
        self.assertAlmostEqual(self.browser.run("return view.ply.count;") / inside, 1, delta=0.02)
        self.browser.picture(self.folder / "box-plane-in-base.png")
        self.browser.click("#box-whole")
        self.scan("pixels")
        self.assertAlmostEqual(self.browser.run("return view.ply.count;") / beyond, 1, delta=0.02)
        self.browser.click("#box-for-all")
        self.browser.wait("boxChosen === null", "it is not set")
        with service.client() as client:
            self.assertEqual(client.call("settings")[0]["set"]["cloud"], {"box": []})
        self.assertEqual(self.browser.complaints(), [])

    def test_a_box_in_the_robots_base_is_not_drawn_and_gives_way(self):
        service = self.in_base("box = [-1000, -1000, 5100, 1000, 1000, 7100]")
        self.browser.wait("boxIsInBase()", "no word of the box")
        self.assertIn("a box in the robot's base. The page cannot draw it.", self.note())
        self.scan("pixels")
        self.assertEqual(self.browser.run("return [view.boxLines.length, document.getElementById('x-from').value];"), [1, ""])
        self.set_box((-1000, -1000, 100, 1000, 1000, 2100))
        self.assertEqual(self.browser.run("return view.boxLines.length;"), 2)
        count = self.browser.run("return view.ply.count;")
        self.scan("pixels")
        self.assertEqual(self.browser.run("return view.ply.count;"), count)  # the same box
        self.browser.click("#box-for-all")
        self.browser.wait("boxChosen === null", "it is not set")
        with service.client() as client:
            self.assertEqual(client.call("settings")[0]["set"]["cloud"], {"box": [-1000, -1000, 100, 1000, 1000, 2100], "box_frame": "rig"})
            self.assertEqual(client.call("scan", density="pixels", timeout_ms=600000)[0]["points"], count)
        self.assertEqual(self.note(), "Every scan measures only this box.")
        self.assertEqual(self.browser.complaints(), [])

    def test_a_status_from_before_a_change_is_not_shown(self):
        """An answer that is on its way while the page sets a box."""
        self.open()
        self.browser.run("""
            const fetched = window.fetch;
            window.held = [];
            window.fetch = async (path, options) => {
              const answer = await fetched(path, options);
              if (path === "api/status" && held.length === 0) await new Promise((done) => held.push(done));
              return answer;
            };""")
        self.browser.wait("held.length === 1", "no status was asked for")
        self.browser.click("#box summary")
        box = [-100, -100, 100, 100, 100, 2100]
        self.set_box(box)
        self.browser.click("#box-for-all")
        self.browser.wait("boxChosen === null", "it is not set")
        self.assertEqual(self.browser.run("""
            const boxes = [], follow = followPart;
            followPart = (part) => { follow(part); boxes.push(partOfService.box); };
            held.push(boxes);
            held[0]();
            return partOfService.box;"""), box)
        self.browser.wait("held[1].length > 1", "no more statuses")
        self.assertEqual(self.browser.run("return held[1].slice(0, 2);"), [box, box])
        self.assertEqual(self.browser.complaints(), [])

    def test_a_box_and_a_chosen_preset_do_not_mix(self):
        state = self.enterContext(tempfile.TemporaryDirectory(prefix="slsd-test-"))
        service = self.enterContext(Service(configuration=CONFIGURATION, environment={"STATE_DIRECTORY": state}))
        self.web = self.enterContext(Web(service))
        service.wait_ready()
        with service.client() as client:
            client.call("preset", action="save", name="part")
            client.call("set", decode={"density": "pixels"})  # other settings than the preset's
        self.open()
        self.scan("symbols")
        self.browser.wait("presets.part && presetInForce === null", "no preset")
        self.choose("preset", "part")
        self.browser.click("#box summary")
        self.set_box((-100, -100, 100, 100, 100, 2100))
        self.browser.wait("/Scan with the chosen preset first/.test(document.getElementById('message').textContent)", "no message")
        self.assertEqual(self.browser.run("return partOfScan();"), {})
        self.scan("symbols")
        self.assertTrue(self.browser.run("return document.getElementById('message').hidden;"))
        self.set_box((-100, -100, 100, 100, 100, 2100))
        self.assertEqual(self.box(), [-100, -100, 100, 100, 100, 2100])

    def test_a_box_that_is_wrong_has_its_message_and_changes_nothing(self):
        self.open()
        self.scan("pixels")
        self.choose("shown-as", "z")
        self.browser.wait("map.records", "no map")
        before = self.browser.run("return shownScan.scan;")
        self.browser.click("#box summary")
        self.browser.click("#box-draw")
        self.drag("#map", (2, 2), (3, 3))
        self.browser.wait("/too few points/.test(document.getElementById('message').textContent)", "no message")
        for name, value in zip(("x-from", "x-to", "y-from", "y-to", "z-from", "z-to"), (10, -10, 0, 10, 2000, 2100)):
            self.choose(name, value)
        self.browser.wait("/end of x must be greater/.test(document.getElementById('message').textContent)", "no message")
        self.assertIsNone(self.box())
        for name, value in (("x-to", 90010), ("x-from", 90000)):  # far aside
            self.choose(name, value)
        self.assertEqual(self.box(), [90000, 0, 2000, 90010, 10, 2100])
        self.browser.click("#scan")
        self.browser.wait("!document.getElementById('message').hidden && !document.getElementById('scan').disabled", "no message")
        self.assertIn("box", self.browser.run("return document.getElementById('message').textContent;"))
        self.assertEqual(self.browser.run("return shownScan.scan;"), before)

    def test_a_scan_says_how_far_it_is(self):
        self.open()
        self.browser.run("""
            window.told = [];
            new MutationObserver(() => told.push([document.getElementById('progress-text').textContent,
                                                  document.getElementById('progress-bar').getAttribute('value')]))
              .observe(document.getElementById('progress'), {childList: true, characterData: true, subtree: true, attributes: true});""")
        self.scan("pixels")
        first = self.browser.run("return told.splice(0);")
        self.assertRegex(first[0][0], r"^Scanning: \d+\.\d s$")
        self.assertIsNone(first[0][1])  # nothing is known of the time yet
        received = [(text, float(share)) for text, share in first if text.startswith("Receiving") and share]
        self.assertRegex(received[-1][0], r"^Receiving: (\d+\.\d) of \1 MB$")
        self.assertEqual(received[-1][1], 1)
        self.scan("pixels")
        second = self.browser.run("return told.splice(0);")
        self.assertRegex(second[0][0], r"of about \d+\.\d s")
        self.browser.wait("document.getElementById('progress').hidden", "it stays")
        self.service.stop()
        self.browser.click("#scan")
        self.browser.wait("!document.getElementById('message').hidden", "no message")
        self.browser.wait("document.getElementById('progress').hidden", "it stays after an error")


if __name__ == "__main__":
    unittest.main(verbosity=2)
