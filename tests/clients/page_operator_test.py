#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What an operator does on the page: exposes, scans, measures and saves with few clicks; presets, boards to print, keys, full
screen. SLSD_PICTURES=FOLDER keeps pictures of the views."""
import os
import pathlib
import tempfile
import unittest

from browser import Browser, is_there
from page_service import Web, downloaded
from gige_double import Double, service_on
from service import Service, wait_until

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
BOARDS = pathlib.Path(__file__).resolve().parents[2] / "config" / "boards"
CAN_SCAN = "!document.getElementById('scan').disabled"
CLICKS_MAX = 8
LONG = "\n[scan]\ntimeout_ms = 600000"  # after the camera's table: a busy machine is slow to reopen a camera
# Where two points of the cloud are in the view.
TWO_POINTS = """
const at = view.points.geometry.getAttribute('position').array, place = document.getElementById('space').getBoundingClientRect();
return [Math.floor(view.ply.count / 3), Math.floor(2 * view.ply.count / 3)].map((index) => {
  const p = new THREE.Vector3(at[3 * index], at[3 * index + 1], at[3 * index + 2]).project(view.camera);
  return [(p.x + 1) / 2 * place.width, (1 - p.y) / 2 * place.height];
});"""


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Operator(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))

    def text(self, browser, name):
        return browser.run("return document.getElementById(arguments[0]).textContent;", name)

    def choose(self, browser, name, value):
        browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                    "c.dispatchEvent(new Event('change'));", name, value)

    def test_a_stranger_exposes_scans_measures_and_saves_with_few_clicks(self):
        double = Double()
        self.addCleanup(double.close)
        for width, height, scheme in ((1600, 1100, "light"), (1280, 900, "dark"), (390, 844, "light")):
            with service_on(double, f"exposure_us = 4000.0{LONG}") as service, Web(service) as web, \
                    tempfile.TemporaryDirectory() as downloads, Browser(downloads) as browser:
                service.wait_ready()
                browser.resize(width, height)
                browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
                browser.open(web.address)
                browser.run("window.clicks = 0; document.addEventListener('pointerdown', (e) => { clicks += e.isTrusted; }, true);")
                browser.wait(CAN_SCAN, "nothing to draw clouds with")
                browser.wait("!document.getElementById('expose').disabled", "no exposure can be set")
                self.stranger(browser, width, downloads)
                clicks = browser.run("return clicks;")
                print(f"clicks to expose, scan, measure and save at {width} px: {clicks}")
                self.assertLessEqual(clicks, CLICKS_MAX)
                self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), width)
                browser.picture(self.folder / f"operator-{scheme}-{width}.png")
                self.assertEqual(browser.complaints(), [])

    def stranger(self, browser, width, downloads):
        """By what the buttons say alone."""
        narrow = width < 1100
        if narrow:
            browser.click("nav [data-view=camera]")
        browser.click("#expose")
        browser.wait("/^Set: exposure_us|good as it is/.test(document.getElementById('exposure').textContent)", "no exposure")
        if narrow:
            browser.click("nav [data-view=cloud]")
        browser.click("#scan")
        browser.wait("/points of scan/.test(document.getElementById('cloud-figures').textContent)", "no cloud")
        browser.wait("view.ply.count > 2000 && view.drawn > 0", "no points")
        for x, y in browser.run(TWO_POINTS):
            browser.drag("#space", (x, y), (x, y))
        browser.wait("/mm ±/.test(document.getElementById('distance').textContent)", "no distance")
        browser.click("#save-ply")
        downloaded(downloads, "*.ply")

    def test_sliders_set_exposure_and_gain_and_follow_what_is_in_force(self):
        double = Double()
        self.addCleanup(double.close)
        with service_on(double, f"exposure_us = 4000.0{LONG}") as service, Web(service) as web, Browser() as browser, \
                service.client() as client:
            service.wait_ready()
            browser.resize(1280, 900)
            browser.open(web.address)
            number, slider = "document.getElementById('exposure-us')", "document.getElementById('exposure-slider')"
            browser.wait(f"{number}.value === '4000' && !{number}.disabled", "it does not show what is in force")
            moved = browser.run(f"const s = {slider}; s.value = 700; s.dispatchEvent(new Event('input')); return Number({number}.value);")
            self.assertAlmostEqual(moved / (10 * 1e5 ** 0.7), 1, delta=0.01)
            self.assertEqual(client.call("settings")[0]["cameras"][0]["exposure_us"], 4000)  # while a hand moves it
            browser.run(f"{slider}.dispatchEvent(new Event('change'));")
            browser.wait("/^Set: exposure_us/.test(document.getElementById('exposure').textContent)", "it is not set")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["exposure_us"], moved)
            browser.run(f"{slider}.focus();")
            browser.key("\ue014")  # the right arrow
            wait_until(lambda: client.call("settings")[0]["cameras"][0]["exposure_us"] > moved, "a key does not move it")
            browser.wait("!moving", "it is still being set")
            client.call("set", camera={"camera": {"gain_db": 6.0}})  # by another client
            browser.wait("document.getElementById('gain-db').value === '6'", "the page does not follow")
            self.assertEqual(browser.run("return document.getElementById('gain-slider').value;"), "60")
            browser.run("const n = document.getElementById('gain-db'); n.value = 59; n.dispatchEvent(new Event('change'));")
            browser.wait("/0 to 24, not 59/.test(document.getElementById('message').textContent)", "no reason")
            browser.wait("document.getElementById('gain-db').value === '6'", "it does not go back")
            self.assertEqual(client.call("settings")[0]["cameras"][0]["gain_db"], 6)
            browser.picture(self.folder / "sliders-1280.png")
            browser.resize(390, 844)
            browser.click("nav [data-view=camera]")
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            browser.picture(self.folder / "sliders-390.png")
            self.assertEqual(browser.complaints(expected="/api/set"), [])  # the one that was refused

    def test_a_camera_without_an_exposure_says_so(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            browser.resize(1280, 900)
            browser.open(web.address)
            browser.wait("/plays back images/.test(document.getElementById('exposure-note').textContent)", "no word about it")
            self.assertEqual(browser.run("return ['exposure-slider', 'exposure-us', 'gain-slider', 'gain-db']"
                                         ".map((id) => document.getElementById(id).disabled);"), [True] * 4)

    def test_presets_are_saved_chosen_applied_and_deleted(self):
        with tempfile.TemporaryDirectory() as state, Service(environment={"STATE_DIRECTORY": state}) as service, \
                Web(service) as web, Browser() as browser, service.client() as client:
            service.wait_ready()
            browser.resize(1280, 900)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            browser.wait("!document.getElementById('preset-save').disabled", "no preset can be saved")
            for name, depth_mm in (("near", 600.0), ("far", 9000.0)):
                client.call("set", decode={"depth_max_mm": depth_mm})
                browser.run("document.getElementById('preset-name').value = arguments[0];", name)
                browser.click("#preset-save")
                browser.wait(f"document.getElementById('preset').value === '{name}'", f"{name} is not in force")
            self.assertIn("depth_max_mm = 9000", self.text(browser, "preset-about"))
            for name, seen in (("near", False), ("far", True)):
                self.choose(browser, "preset", name)
                self.assertIn("with the next scan", self.text(browser, "preset-about"))
                self.assertNotEqual(client.call("presets")[0]["in_force"], name)
                browser.run("window.before = shownScan && shownScan.scan;")
                browser.click("#scan")
                browser.wait("shownScan && shownScan.scan !== window.before && !document.getElementById('scan').disabled", "no cloud")
                self.assertEqual(browser.run("return [shownScan.points > 2000, shownScan.preset];"), [seen, name])
                self.assertEqual(client.call("presets")[0]["in_force"], name)
                browser.wait("!/next scan/.test(document.getElementById('preset-about').textContent)", "it is not in force")
            client.call("preset", action="use", name="near")  # by another client
            browser.wait("document.getElementById('preset').value === 'near'", "the page does not follow")
            browser.run("document.getElementById('preset-name').value = 'a name with blanks';")
            browser.click("#preset-save")
            browser.wait("/letters, digits/.test(document.getElementById('message').textContent)", "a bad name has no message")
            browser.run("document.getElementById('preset-name').value = '';")
            browser.click("#preset-save")
            browser.wait("/Enter a name/.test(document.getElementById('message').textContent)", "no name has no message")
            browser.click("#preset-delete")
            browser.wait("![...document.getElementById('preset').options].some((o) => o.value === 'near')", "it is still there")
            self.assertEqual(list(client.call("presets")[0]["presets"]), ["far"])

    def test_a_preset_that_vanished_is_refused_by_name_and_nothing_is_scanned(self):
        with tempfile.TemporaryDirectory() as state, Service(environment={"STATE_DIRECTORY": state}) as service, \
                Web(service) as web, Browser() as browser, service.client() as client:
            service.wait_ready()
            client.call("set", decode={"depth_max_mm": 600.0})
            client.call("preset", action="save", name="gone")
            client.call("set", decode={"depth_max_mm": None})
            browser.resize(1280, 900)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            browser.wait("[...document.getElementById('preset').options].some((o) => o.value === 'gone')", "no preset")
            self.choose(browser, "preset", "gone")
            client.call("preset", action="delete", name="gone")
            browser.run("return readPresets();")
            self.assertEqual(browser.run("return document.getElementById('preset').value;"), "gone")  # it was chosen
            self.assertIn("was deleted", self.text(browser, "preset-about"))
            before = client.call("status")[0]["scans"]["succeeded"]
            browser.click("#scan")
            browser.wait("/gone/.test(document.getElementById('message').textContent)", "no message")
            self.assertEqual(client.call("status")[0]["scans"]["succeeded"], before)
            browser.wait("document.getElementById('preset').value === ''", "the page still offers it")

    def test_boards_are_listed_with_their_pdfs(self):
        with Service() as service, Web(service, "--boards", BOARDS) as web, tempfile.TemporaryDirectory() as downloads, \
                Browser(downloads) as browser:
            browser.resize(390, 844)
            browser.open(web.address)
            browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "no state")
            browser.click("nav [data-view=calibrate]")
            browser.click("#boards summary")
            browser.wait("document.querySelectorAll('#board-list li').length > 0", "no boards")
            lines = browser.run("return [...document.querySelectorAll('#board-list li span')].map((s) => s.textContent);")
            files = sorted(BOARDS.glob("*.pdf"))
            self.assertEqual(len(lines), len(files))
            self.assertEqual(lines[0], "A4: ChArUco, 11 × 7 squares of 23 mm")
            self.assertTrue(lines[-1].startswith("A1: "), lines)
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), 390)
            browser.picture(self.folder / "boards-390.png")
            browser.click("#board-list li button")
            self.assertEqual(downloaded(downloads, "*.pdf")[0].read_bytes(), files[0].read_bytes())
            browser.click("#board-list li button:last-child")
            self.assertEqual(browser.run("return document.getElementById('board').value;"), "charuco:11x7:23:17.25:DICT_5X5_1000")
            self.assertEqual(browser.complaints(), [])

    def test_without_boards_the_page_says_what_to_install(self):
        with Service() as service, tempfile.TemporaryDirectory() as empty:
            pathlib.Path(empty, "notes.pdf").write_text("no board", encoding="utf-8")
            with Web(service, "--boards", empty) as web, Browser() as browser:
                browser.resize(1280, 900)
                browser.open(web.address)
                browser.wait("document.getElementById('state').textContent === 'Ready to scan.'", "no state")
                browser.click("#boards summary")
                browser.wait("/install slsd-calibrate/.test(document.getElementById('message').textContent)", "no message")
                self.assertEqual(web.get("/api/board?name=notes")[0], 404)
            with Web(service, "--boards", BOARDS) as web:
                for name in ("", "../boards/plane-6x4-60mm-a3", "plane-6x4-60mm-a3.pdf"):
                    self.assertEqual(web.get("/api/board?name=" + name)[0], 404, name)

    def test_keys_do_what_the_buttons_do_but_not_while_one_writes(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            browser.resize(1280, 900)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            browser.key("?")
            self.assertTrue(browser.run("return document.getElementById('help').open;"))
            keys = browser.run("return [...document.querySelectorAll('#key-list kbd')].map((k) => k.textContent);")
            self.assertEqual(len(keys), len(set(keys)))
            browser.picture(self.folder / "keys-1280.png")
            browser.key("s")  # not while the help is read
            browser.key("?")
            self.assertFalse(browser.run("return document.getElementById('help').open;"))
            self.assertIsNone(browser.run("return shownScan;"))
            browser.run("document.getElementById('preset-name').focus();")
            browser.key("s")
            self.assertEqual(browser.run("return [document.getElementById('preset-name').value, shownScan];"), ["s", None])
            browser.run("document.activeElement.blur();")
            browser.key("s")
            browser.wait("shownScan && view.ply.count > 2000", "no cloud")
            browser.key("m")
            self.assertFalse(browser.run("return document.getElementById('measure').checked;"))
            browser.key("m")
            self.assertTrue(browser.run("return document.getElementById('measure').checked;"))
            self.full_screen(browser, "f", "cloud", "#space")
            self.full_screen(browser, "g", "camera", "#picture")
            browser.run("for (const key of 'ffffg') document.dispatchEvent(new KeyboardEvent('keydown', {key}));")
            browser.run("return screenChanges;")
            self.assertEqual(browser.run("return document.body.dataset.full;"), "camera")
            browser.run("toggleFull('camera'); return screenChanges;")
            browser.resize(390, 844)
            for key, view in (("1", "devices"), ("4", "model"), ("5", "calibrate"), ("3", "cloud")):
                browser.key(key)
                self.assertEqual(browser.run("return [...document.querySelectorAll('main section')]"
                                             ".filter((s) => s.offsetParent).map((s) => s.id);"), [view])
            self.assertEqual(browser.complaints(), [])

    def full_screen(self, browser, key, view, large):
        width = browser.run("return document.querySelector(arguments[0]).getBoundingClientRect().width;", large)
        shown = "return [...document.querySelectorAll('main section')].filter((s) => s.offsetParent).map((s) => s.id);"
        browser.key(key)
        self.assertEqual(browser.run(shown), [view])
        self.assertGreater(browser.run("return document.querySelector(arguments[0]).getBoundingClientRect().width;", large), width)
        self.assertEqual(browser.run("return document.querySelector('#' + arguments[0] + ' [data-full-screen]')"
                                     ".getAttribute('aria-pressed');", view), "true")
        browser.picture(self.folder / f"full-{view}-1280.png")
        browser.click(f"#{view} [data-full-screen]")
        browser.wait("!document.body.dataset.full", "it stays in full screen")
        self.assertGreater(len(browser.run(shown)), 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
