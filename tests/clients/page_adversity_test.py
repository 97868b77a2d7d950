#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The page where things are not as usual: no token, a service that hangs, a proxy's path, graphics that are taken away; what
it offers of each kind of cloud; and whether its text can be read."""
import os
import pathlib
import signal
import tempfile
import types
import unittest

import numpy as np

from browser import Browser, is_there
from impostor import Impostor, result
from page_service import Web, downloaded
from path_proxy import PathProxy
from point_cloud import vertices
from service import Service, slsctl

THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")
READY = "document.getElementById('state').textContent === 'Ready to scan.'"
CAN_SCAN = "!document.getElementById('scan').disabled"
VIEWS = ("devices", "camera", "cloud", "model", "calibrate", "history")
CONTROLS = {"button", "checkbox", "combobox", "slider", "spinbutton", "textbox"}
BACKGROUND = [0x16, 0x18, 0x1c]

# Text that is too faint for its background (WCAG 2.1, 1.4.3: 4.5), with the ratio; disabled controls count, too.
FAINT = """
const numbers = (colour) => {
  const canvas = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
  canvas.fillStyle = colour;
  canvas.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
  return [r, g, b, a / 255];
};
const over = ([r, g, b, a], [x, y, z]) => [r * a + x * (1 - a), g * a + y * (1 - a), b * a + z * (1 - a), 1];
const light = (c) => [0.2126, 0.7152, 0.0722].reduce((sum, part, i) => {
  const x = c[i] / 255;
  return sum + part * (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
}, 0);
const canvasColour = matchMedia("(prefers-color-scheme: dark)").matches ? [18, 18, 18, 1] : [255, 255, 255, 1];
const behind = (element) => {
  const layers = [];
  for (let each = element; each; each = each.parentElement) {
    layers.push(numbers(getComputedStyle(each).backgroundColor));
    if (each.tagName === "DIALOG") break;
  }
  return layers.reverse().reduce((below, layer) => over(layer, below), canvasColour);
};
const opacity = (element) => {
  let product = 1;
  for (let each = element; each; each = each.parentElement) product *= Number(getComputedStyle(each).opacity);
  return product;
};
const ratio = (element, style) => {
  const below = behind(element), [r, g, b, a] = numbers(style.color);
  const [x, y] = [light(over([r, g, b, a * opacity(element) * Number(style.opacity)], below)), light(below)].sort((p, q) => q - p);
  return (x + 0.05) / (y + 0.05);
};
const found = [];
let looked = 0;
for (const element of document.querySelectorAll("body *")) {
  if (element.offsetParent === null && getComputedStyle(element).position !== "fixed") continue;
  const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()) ||
    ["INPUT", "SELECT"].includes(element.tagName);
  const judge = (style, what) => {
    ++looked;
    const value = ratio(element, style);
    if (value < 4.5) found.push(`${what}: ${value.toFixed(2)}`);
  };
  if (own) judge(getComputedStyle(element), `${element.tagName}#${element.id} ${element.textContent.trim().slice(0, 30)}`);
  if (element.placeholder) judge(getComputedStyle(element, "::placeholder"), `placeholder of ${element.id}`);
}
return [looked, found];
"""


@unittest.skipUnless(is_there() and THREE.exists(), "no Chromium with its driver, or no three.js (./run deps)")
class Adversity(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(os.environ.get("SLSD_PICTURES") or tempfile.mkdtemp(prefix="slsd-test-"))

    def choose(self, browser, name, value):
        browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                    "c.dispatchEvent(new Event('change'));", name, value)

    def read(self, kind, data):
        """What a cloud's header tells, but for the scan and the fields' types; and its points."""
        head, records = data.split(b"end_header\n" if kind == "ply" else b"DATA binary\n", 1)
        lines = head.decode().splitlines()
        if kind == "ply":
            types = [line.split()[1:] for line in lines if line.startswith("property")]
            fields = [(name, {"float": "<f4", "uchar": "u1", "int": "<i4"}[kind]) for kind, name in types]
        else:
            names, sizes, types = ([line.split()[1:] for line in lines if line.startswith(key)][0] for key in ("FIELDS", "SIZE", "TYPE"))
            fields = [(name, f"<{kind.lower()}{size}") for name, kind, size in zip(names, types, sizes)]
        told = [line for line in lines if not any(word in line for word in ("scan_id", " time ", " frame ", "SIZE", "TYPE"))]
        return told, np.frombuffer(records, fields)

    def scan(self, browser, density):
        self.choose(browser, "density", density)
        browser.run("window.before = shownScan && shownScan.scan;")
        browser.click("#scan")
        browser.wait("shownScan && shownScan.scan !== window.before && !document.getElementById('scan').disabled", "no cloud")

    def test_without_a_token_it_asks_and_with_it_no_complaint_stays(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            page = f"http://127.0.0.1:{web.port}/"
            browser.open(page)
            browser.wait("document.getElementById('login').open", "no token is asked for")
            self.assertEqual(browser.run("return document.getElementById('message').hidden;"), True)
            browser.run("document.getElementById('token').value = 'guess';")
            browser.click("#login-form button")
            browser.wait("/not the token/.test(document.getElementById('login-message').textContent)", "a wrong one is taken")
            browser.picture(self.folder / "login.png")
            browser.run("document.getElementById('token').value = arguments[0];", web.token)
            browser.click("#login-form button")
            browser.wait(READY, "no state")
            browser.wait("/clipped/.test(document.getElementById('picture-figures').textContent)", "no picture")
            self.assertEqual(browser.run("return [document.getElementById('login').open, document.getElementById('message').hidden];"),
                             [False, True])
            browser.open(page)  # it is let in from now on
            browser.wait(READY, "no state")
            browser.open(web.address)
            browser.wait(READY, "no state")
            self.assertEqual(browser.run("return location.href;"), page)  # nothing secret stays in the address
            browser.devtools("Network.clearBrowserCookies")
            browser.open(web.address[:-4] + "0000")
            browser.wait("document.getElementById('login').open", "a wrong address is taken")
            self.assertIn("The token in this address", browser.run("return document.getElementById('login-message').textContent;"))

    def test_a_service_that_hangs_is_not_called_ready(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            browser.open(web.address)
            browser.wait(READY, "no state")
            for hung, what in ((service.process, "slsd"), (web.process, "slsd-web")):
                hung.send_signal(signal.SIGSTOP)
                try:
                    browser.wait("document.getElementById('state').className === 'bad'", f"it does not say that {what} hangs")
                    self.assertIn("does not answer", browser.run("return document.getElementById('state').textContent;"))
                finally:
                    hung.send_signal(signal.SIGCONT)
                browser.wait(READY, f"{what} is not back")

    def test_a_knocked_camera_names_the_remedy(self):
        with Service() as service, service.client() as client:
            service.wait_ready()
            told = {method: client.call(method)[0] for method in ("status", "settings", "presets")}
        told["status"]["cameras"][0]["calibration"] = {"epipolar_px": 0.9, "limit_px": 0.25, "off_since_scan": 7, "scans": 40}
        with Impostor(lambda request: result(request, **told.get(request["method"], {}))) as impostor:
            status = slsctl("--socket", impostor.path, "status").stdout
            self.assertRegex(status, r"since scan 7: 0\.90 px off .*\n +fasten .* slsd --correct with a board in view")
            with Web(types.SimpleNamespace(socket=impostor.path)) as web, Browser() as browser:
                browser.open(web.address)
                browser.wait("/since scan 7: .*0.90 px off.* slsd --correct with a board/.test(document.getElementById('device-list')"
                             ".textContent)", "no remedy")
                self.assertEqual(browser.run("return document.getElementById('state').textContent;"),
                                 "Knocked out of its calibration: clouds may be wrong.")

    def test_several_scanners_lie_below_paths_of_one_name(self):
        with Service() as left, Service() as right, Web(left) as one, Web(right) as other, \
                PathProxy(left=one.port, right=other.port) as proxy, Browser() as browser:
            for name, web in (("left", one), ("right", other), ("left", one)):
                browser.resize(1600, 1100)
                browser.open(f"http://127.0.0.1:{proxy.port}/{name}/?token={web.token}")
                browser.wait(READY, f"no state of {name}")
                browser.wait("/clipped/.test(document.getElementById('picture-figures').textContent)", "no picture")
                browser.wait(CAN_SCAN, "nothing to draw clouds with")
                browser.click("#scan")
                browser.wait("/points of scan/.test(document.getElementById('cloud-figures').textContent)", "no cloud")
                self.assertEqual(browser.run("return location.pathname;"), f"/{name}/")
                cookies = browser.devtools("Network.getCookies")["cookies"]
                self.assertEqual([(cookie["path"], cookie["sameSite"], cookie["httpOnly"]) for cookie in cookies],
                                 [(f"/{name}", "Strict", True)])
            browser.open(f"http://127.0.0.1:{proxy.port}/right/")  # who is in stays in
            browser.wait(READY, "no state of right")
            self.assertEqual([path for path in proxy.asked if not path.startswith(("/left/", "/right/"))], [])
            self.assertEqual(browser.complaints(), [])

    def test_graphics_that_are_taken_away_are_told_and_come_back(self):
        pixel = """
            view.render(performance.now());  // what a canvas shows is there only until the browser has drawn it
            const gl = view.renderer.getContext(), size = [gl.drawingBufferWidth, gl.drawingBufferHeight];
            const all = new Uint8Array(4 * size[0] * size[1]);
            gl.readPixels(0, 0, ...size, gl.RGBA, gl.UNSIGNED_BYTE, all);
            let others = 0;
            for (let i = 0; i < all.length; i += 4) others += all[i] !== all[0] || all[i + 1] !== all[1];
            return [[...all.slice(0, 3)], others > 500];"""
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            browser.resize(1600, 1100)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            self.scan(browser, "symbols")
            self.assertEqual(browser.run(pixel), [BACKGROUND, True])
            take = "window.lost = view.renderer.getContext().getExtension('WEBGL_lose_context'); lost.loseContext();"
            told = "!document.getElementById('lost').hidden"
            browser.run(take)
            browser.wait(told, "it does not say that the graphics are gone")
            self.assertEqual(browser.run("return view.renderer.domElement.offsetParent;"), None)  # a browser's own sign is there
            browser.picture(self.folder / "lost-1600.png")
            browser.run("lost.restoreContext();")
            browser.wait("document.getElementById('lost').hidden", "it does not say that they are back")
            self.assertEqual(browser.run(pixel), [BACKGROUND, True])
            for _ in range(2):  # a browser that does not give them back: another canvas
                browser.run(take)
                browser.wait(told, "it does not say that the graphics are gone")
                self.scan(browser, "symbols")
                browser.click("#draw-again")
                browser.wait("document.getElementById('lost').hidden", "it does not draw again")
                self.assertEqual(browser.run(pixel), [BACKGROUND, True])
            self.assertEqual(browser.run("return document.querySelectorAll('#space canvas').length;"), 1)

    def test_each_kind_of_cloud_has_its_colours_and_its_files(self):
        with Service() as service, Web(service) as web, tempfile.TemporaryDirectory() as downloads, \
                Browser(downloads) as browser, service.client() as client:
            service.wait_ready()
            browser.resize(1600, 1100)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            offered = "return [...document.getElementById('colour').options].filter((o) => !o.disabled).map((o) => o.value);"
            for density in ("symbols", "pixels"):
                self.choose(browser, "density", "symbols")
                self.choose(browser, "colour", "symbol")
                self.scan(browser, density)
                symbol = ["symbol"] if density == "symbols" else []
                self.assertEqual(browser.run(offered), ["z", "intensity", "sigma_mm", *symbol, "own"])
                self.assertEqual(browser.run("return [view.colour, document.getElementById('colour').value];"),
                                 2 * (symbol or ["z"]))
                name = browser.run("return shownScan.scan;")
                for extension in ("ply", "pcd"):
                    browser.click(f"#save-{extension}")
                pcd, ply = (file.read_bytes() for file in downloaded(downloads, f"{name}.p??", 2))
                self.assertEqual(len(vertices(ply)), browser.run("return view.ply.count;"))
                # A frame that is played back gives the same points: what the service itself writes is the same but for names.
                for kind, saved in (("ply", ply), ("pcd", pcd)):
                    _, own = client.call("scan", format=kind, density=density, timeout_ms=600000)
                    (told, points), (own_told, own_points) = self.read(kind, saved), self.read(kind, own)
                    self.assertEqual(told, own_told)
                    self.assertEqual(points.dtype.names, own_points.dtype.names)
                    for field in points.dtype.names:
                        self.assertTrue(np.array_equal(points[field], own_points[field], equal_nan=True), (density, kind, field))
            browser.click("#cloud-live")
            shown = browser.run("return shownScan.scan;")
            browser.wait(f"shownScan.scan !== '{shown}'", "no live cloud")
            browser.click("#cloud-live")
            self.assertEqual(browser.run("return [document.getElementById('save-pcd').disabled, "
                                         "document.getElementById('save-hint').hidden];"), [True, False])

    def test_all_text_can_be_read_and_nothing_is_wider_than_the_window(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            browser.resize(1600, 1400)
            for scheme in ("light", "dark"):
                browser.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
                browser.open(f"http://127.0.0.1:{web.port}/")
                browser.wait("document.getElementById('login').open", "no token is asked for")
                looked, faint = browser.run(FAINT)
                self.assertEqual((looked > 10, faint), (True, []), scheme)
                browser.open(web.address)
                browser.wait(READY, "no state")
                browser.wait(CAN_SCAN, "nothing to draw clouds with")
                self.scan(browser, "symbols")
                browser.run("""
                    say("test", new Error("a complaint"));
                    document.getElementById("distance").textContent = "a distance";
                    for (const record of [10, 500, 900, 1500]) measurements.add(pointOf(view.ply, record));
                    for (const each of document.querySelectorAll("[hidden]")) each.hidden = false;
                    for (const each of document.querySelectorAll("details")) each.open = true;
                    for (const kind of ["good", "wait", "bad"]) document.getElementById("verdict").append(element("p", kind, kind));
                    document.getElementById("save-pcd").disabled = true;""")
                for width, height in ((1600, 1400), (1280, 900), (390, 844)):
                    browser.resize(width, height)
                    for view in VIEWS if width < 1100 else ("all",):
                        if width < 1100:
                            browser.click(f"nav [data-view={view}]")
                        looked, faint = browser.run(FAINT)
                        self.assertEqual((looked > (50 if width > 1100 else 8), faint), (True, []), (scheme, width, view))
                        self.assertLessEqual(browser.run("return document.documentElement.scrollWidth;"), width, (scheme, view))
                        browser.picture(self.folder / f"{view}-{scheme}-{width}.png")
                browser.resize(1600, 1400)
                browser.key("?")
                self.assertEqual(browser.run(FAINT)[1], [], f"help, {scheme}")
                browser.devtools("Network.clearBrowserCookies")

    def test_every_control_has_a_name_for_screen_readers(self):
        with Service() as service, Web(service) as web, Browser() as browser:
            service.wait_ready()
            browser.resize(1600, 1400)
            browser.open(web.address)
            browser.wait(CAN_SCAN, "nothing to draw clouds with")
            self.scan(browser, "symbols")
            browser.run("for (const record of [10, 500]) measurements.add(pointOf(view.ply, record));"
                        "for (const each of document.querySelectorAll('details')) each.open = true;")
            nodes = browser.devtools("Accessibility.getFullAXTree")["nodes"]
            controls = [(node["role"]["value"], node.get("name", {}).get("value", "")) for node in nodes
                        if not node["ignored"] and node["role"]["value"] in CONTROLS]
            self.assertGreater(len(controls), 35)
            self.assertEqual({role for role, _ in controls} >= {"button", "checkbox", "combobox", "slider", "textbox"}, True)
            self.assertEqual([role for role, name in controls if not name.strip()], [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
