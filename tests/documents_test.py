#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The blocks of PAGES that need no installation run as they are written; the others are sound shell. `./run newcomer` runs
them all. Every file and function that docs/architecture.md names is there."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ["SLSD_BIN"])
sys.path.append(str(SOURCE / "tests/machine"))
from blocks import blocks_of, fits, session_of

PAGES = ("README.md", "docs/protocol.md", "docs/installing.md", "docs/configuration.md", "docs/developing.md")
BLOCKS = [block for page in PAGES
          for block in blocks_of(page, (SOURCE / page).read_text(encoding="utf-8"))]


def block_with(words):
    return next(block for block in BLOCKS if words in block.text)


class Documents(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "build/release").mkdir(parents=True)
        (self.folder / "build/release/bin").symlink_to(BIN)
        for name in ("config", "tests"):
            (self.folder / name).symlink_to(SOURCE / name)
        self.socket = self.folder / "s"
        self.environment = {**os.environ, "SLSD_SOCKET": str(self.socket)}

    def run_here(self, *command, text=None):
        """Its processes end with it, also if it fails half-way."""
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   cwd=self.folder, env=self.environment, start_new_session=True)
        try:
            printed, _ = process.communicate(text, timeout=120)
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self.assertEqual(process.returncode, 0, printed)
        return printed

    def test_scans_without_installing_anything(self):
        block = block_with("scanner.toml")
        text = block.text.replace("./run build\n", "")
        text = text.replace("/tmp/slsd.sock", str(self.socket))  # two runs of this test do not meet
        text = text.replace("[server]", "[scan]\ntimeout_ms = 600000\n[server]")  # the machine may be busy
        text = "trap 'kill $(jobs -p) || true' EXIT\n" + text  # if a command fails, the service ends, too
        program = block_with("socket.AF_UNIX").text
        (self.folder / "program.py").write_text(program, encoding="utf-8")
        text = text.replace("kill %1", f"{sys.executable} program.py && test -s cloud.ply\nkill %1")
        self.run_here("bash", "-e", text=text)
        for name in ("cloud.ply", "decoded.png"):
            self.assertGreater((self.folder / name).stat().st_size, 1000)

    def test_tasks_scan_recorded_frames(self):
        page = (SOURCE / "docs/tasks.md").read_text(encoding="utf-8")
        commands = [line.strip() for line in page.splitlines() if re.match(r"    slsctl (scan|preview) ", line)]
        commands += re.findall(r"`(slsctl scan [^`]+)`", page)
        self.assertGreater(len(commands), 3)
        scanner = SOURCE / "tests/clients/recorded/gap/slsd.toml"
        configuration = scanner.read_text(encoding="utf-8").replace("/tmp/slsd-example.sock", str(self.socket))
        configuration = re.sub(r'(file|path) = "', rf'\1 = "{scanner.parent}/', configuration)
        (self.folder / "slsd.toml").write_text(configuration + "[scan]\ntimeout_ms = 600000\n", encoding="utf-8")
        text = "\n".join(["PATH=$PWD/build/release/bin:$PATH", "slsd --config slsd.toml &",
                          "until slsctl status >/dev/null 2>&1; do sleep 0.1; done", *commands, "kill %1"])
        self.run_here("bash", "-e", text=text)
        for name in re.findall(r"[\w]+\.(?:ply|png|tiff)", " ".join(commands)):
            self.assertGreater((self.folder / name).stat().st_size, 1000, name)

    def test_every_block_is_sound(self):
        self.assertGreater(len(BLOCKS), 15)
        for block in BLOCKS:
            with self.subTest(block.place):
                if block.language == "sh":
                    self.run_here("bash", "-n", text=block.text)
                    self.assertNotIn("newgrp", block.text, "it starts a shell, and the lines after it wait")
                elif block.language == "console":
                    self.assertTrue(session_of(block.text))
                else:
                    self.assertIn(block.language, ("python", "toml"))

    def test_a_session_is_held_against_what_it_should_print(self):
        self.assertEqual(session_of("$ one\na ... c\n$ two\n"), [("one", ["a ... c"]), ("two", [])])
        self.assertTrue(fits(["a ... c"], "before\na b c\nafter\n"))
        self.assertFalse(fits(["a ... c", "x"], "x\na b c\n"))


class Map(unittest.TestCase):
    ROOMS = ("bench", "clients", "config", "core", "daemon", "docs", "drivers", "man", "picture", "programs", "rpc", "systemd", "tests")

    @classmethod
    def setUpClass(cls):
        cls.names = re.findall(r"`([^`\s]+)`", (SOURCE / "docs/architecture.md").read_text(encoding="utf-8"))
        cls.files = [f"/{file.relative_to(SOURCE)}" for room in cls.ROOMS for file in (SOURCE / room).rglob("*") if file.is_file()]

    def test_names_files_that_are_there(self):
        named = {name for name in self.names if re.fullmatch(r"[\w/.-]+\.(cpp|hpp|py|toml|js|html|css|md|catalog|[158])", name)}
        self.assertGreater(len(named), 50)
        self.assertEqual({name for name in named if not any(file.endswith(f"/{name}") for file in self.files)}, set())

    def test_names_functions_that_are_there(self):
        named = {name.removesuffix("()").rpartition("::")[2] for name in self.names if re.fullmatch(r"[\w:]+\(\)", name)}
        self.assertGreater(len(named), 25)
        sources = "".join((SOURCE / file[1:]).read_text(encoding="utf-8") for file in self.files if file.endswith(("pp", ".in")))
        known = set(re.findall(r"\w+", sources))
        self.assertEqual(named - known, set())


if __name__ == "__main__":
    unittest.main()
