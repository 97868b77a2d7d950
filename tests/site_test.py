#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The site of ./run site: each page is there, each link leads somewhere, and nothing is loaded from beyond it; and the manual:
each option that a program's --help lists is on its page, and no other."""
import html.parser
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ["SLSD_BIN"])
MAKER = SOURCE / "docs" / "site" / "make_site.py"
MANUAL = {"slsctl": "slsctl.1", "slsd": "slsd.8", "slsd-web": "slsd-web.8", "slsd-tcp": "slsd-tcp.8", "slsd-dds": "slsd-dds.1", "slsd-model": "slsd-model.1"}
COMMANDS = re.compile(r"(?m)^  ([a-z][a-z-]*)  ")  # in groups; options begin with dashes
OPTIONS = re.compile(r"(?<![\w-])(--[a-z][a-z-]*[a-z])")


class Page(html.parser.HTMLParser):
    def __init__(self, file):
        super().__init__()
        self.ids, self.links, self.loads = set(), [], []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.ids.add(attributes.get("id"))
        if tag == "a" and "href" in attributes:
            self.links.append(attributes["href"])
        if tag in ("img", "script", "link", "iframe"):
            self.loads.append(attributes.get("src") or attributes.get("href") or "")


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.folder = pathlib.Path(cls.temporary.name) / "site"
        made = subprocess.run([sys.executable, MAKER, cls.folder], capture_output=True, text=True, check=False)
        if "ModuleNotFoundError" in made.stderr or "'mandoc'" in made.stderr:
            raise unittest.SkipTest("no python3-markdown or no mandoc here (packages)")
        assert made.returncode == 0, made.stderr
        cls.pages = {file: Page(file) for file in cls.folder.rglob("*.html")}

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_every_link_leads_somewhere(self):
        broken = []
        for file, page in self.pages.items():
            for link in page.links:
                if re.match(r"[a-z]+:", link):
                    continue
                path, _, anchor = link.partition("#")
                target = (file.parent / path).resolve() if path else file
                if not target.is_file() or (anchor and target in self.pages and anchor not in self.pages[target].ids):
                    broken.append(f"{file.relative_to(self.folder)}: {link}")
        self.assertEqual(broken, [])

    def test_loads_nothing_from_elsewhere(self):
        for file, page in self.pages.items():
            for load in page.loads:
                self.assertNotRegex(load, r"^([a-z]+:|//)", file)
                self.assertTrue((file.parent / load).is_file(), f"{file}: {load}")

    def test_every_page_of_the_documentation_is_there(self):
        for source in (SOURCE / "docs").glob("*.md"):
            self.assertTrue((self.folder / f"{source.stem}.html").is_file(), source)
        for source in (SOURCE / "docs/notes").glob("*.md"):
            self.assertTrue((self.folder / f"notes-{source.stem}.html").is_file(), source)
        for source in (SOURCE / "man").iterdir():
            self.assertTrue((self.folder / "man" / f"{source.name}.html").is_file(), source)

    def test_every_page_of_the_manual_is_sound(self):
        checked = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", *(SOURCE / "man").iterdir()], capture_output=True,
                                 text=True, check=False)
        complaints = [line for line in checked.stdout.splitlines() if "missing date" not in line]
        self.assertEqual(complaints, [])


class Manual(unittest.TestCase):
    @staticmethod
    def help_of(*command):
        return subprocess.run([BIN / command[0], *command[1:], "--help"], capture_output=True, text=True, check=True).stdout

    def options_of(self, program):
        options = set(OPTIONS.findall(self.help_of(program)))
        if program == "slsctl":
            for command in COMMANDS.findall(self.help_of(program)):
                options |= set(OPTIONS.findall(self.help_of(program, command)))
        return options - {"--help-all"}

    def test_every_option_is_on_the_programs_page_and_no_other(self):
        for program, page in MANUAL.items():
            if not (BIN / program).exists():
                continue
            text = (SOURCE / "man" / page).read_text(encoding="utf-8").replace("\\-", "-")
            text = re.sub(r"\\f[BIRP]", "", text)
            documented = set()
            for line in text.splitlines():  # those of other programs stand beside these programs' names
                if not re.search(r"systemctl|journalctl|v4l2-ctl|xrandr", line):
                    documented |= set(OPTIONS.findall(line))
            with self.subTest(program):
                self.assertEqual(self.options_of(program) - documented, set(), "are missing in " + page)
                others = set().union(*(self.options_of(other) for other in MANUAL if (BIN / other).exists()))
                self.assertEqual(documented - self.options_of(program) - others, set(), "are in no program: " + page)

    def test_every_command_of_slsctl_is_on_its_page(self):
        text = (SOURCE / "man" / "slsctl.1").read_text(encoding="utf-8").replace("\\-", "-")
        commands = COMMANDS.findall(self.help_of("slsctl"))
        self.assertIn("scan", commands)
        for command in commands:
            self.assertRegex(text, rf"(?m)^(\\fB|\.B ){command}\b", command)


if __name__ == "__main__":
    unittest.main(verbosity=2)
