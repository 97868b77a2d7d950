#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""What `cmake --install` puts where: install_test.py CMAKE BUILD_DIR."""
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

CMAKE, BUILD = sys.argv[1:3]
SOURCE = pathlib.Path(__file__).resolve().parents[2]
# Whose messages, comments and pages of the manual a user reads.
NAMING = ("core", "daemon", "drivers", "picture", "rpc", "clients", "config", "man", "systemd")
PAGE = re.compile(r"\bdocs/[a-z_-]+\.md\b")
UNITS = ("slsd.service", "slsd.socket", "slsd@.service", "slsd@.socket", "slsd-display.service", "slsd-web.service", "slsd-tcp.service",
         "slsd-metrics.service", "slsd-metrics.timer")
DDS_UNITS = ("slsd-dds.service", "slsd-dds@.service") if (pathlib.Path(BUILD) / "bin/slsd-dds").exists() else ()
UNITS += DDS_UNITS


def install(prefix, destination):
    subprocess.run([CMAKE, "--install", BUILD, "--prefix", prefix], check=True, capture_output=True,
                   env={"DESTDIR": destination, "PATH": "/usr/bin:/bin"})


ZSHRC = """
fpath=({root}/usr/share/zsh/vendor-completions {root}/usr/share/zsh/site-functions $fpath)
compadd() {{ local -a found; builtin compadd -O found "$@"; print -rl -- $found >>{root}/found; builtin compadd "$@" }}
answer() {{ autoload -Uz compinit; compinit -u -D; zle complete-word; BUFFER=; print -r -- END >>{root}/found }}
zle -N answer
bindkey '^X' answer
print READY
"""


class ZshTerminal:
    """An interactive zsh: it completes nowhere else."""

    def __init__(self, root):
        self.root = root

    def __enter__(self):
        (self.root / ".zshrc").write_text(ZSHRC.format(root=self.root), encoding="utf-8")
        self.process, self.terminal = pty.fork()
        if self.process == 0:
            os.chdir(self.root)
            os.execvpe("zsh", ["zsh", "-d", "-i"], {"PATH": f"{self.root}/usr/bin:/usr/bin:/bin", "ZDOTDIR": str(self.root), "HOME": str(self.root),
                                              "TERM": "dumb", "PS1": "$ "})
        self.wait_until(lambda shown: b"READY" in shown)
        return self

    def __exit__(self, *_):
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)
        os.close(self.terminal)

    def wait_until(self, condition, end_s=120):
        shown, end = b"", time.monotonic() + end_s
        while not condition(shown):
            if time.monotonic() > end:
                raise TimeoutError(shown)
            if select.select([self.terminal], [], [], 0.05)[0]:
                shown += os.read(self.terminal, 4096)

    def complete(self, line):
        found = self.root / "found"
        found.write_text("", encoding="utf-8")
        os.write(self.terminal, line.encode() + b"\x18")
        self.wait_until(lambda _: found.read_text(encoding="utf-8").endswith("END\n"))
        return sorted(set(found.read_text(encoding="utf-8").split()) - {"END"})


class Install(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory(prefix="slsd-test-")
        self.addCleanup(temporary.cleanup)
        self.root = pathlib.Path(temporary.name)

    def test_puts_everything_in_its_place(self):
        install("/usr", str(self.root))
        for file in ("usr/bin/slsd", "usr/bin/slsctl", "usr/bin/slsd-web", "usr/libexec/slsd/slsd-calibrate", "usr/libexec/slsd/slsd-picture",
                     "usr/libexec/slsd/slsd-hand-eye",
                     "usr/libexec/slsd/slsd-datasheet",
                     *(f"usr/lib/systemd/system/{unit}" for unit in UNITS), "usr/share/man/man8/slsd-web.8", "usr/bin/slsd-tcp", "usr/share/man/man8/slsd-tcp.8",
                     "usr/lib/sysusers.d/slsd.conf", "usr/lib/systemd/catalog/slsd.catalog", "usr/lib/udev/rules.d/60-slsd.rules",
                     "usr/share/bash-completion/completions/slsctl", "etc/slsd/slsd.toml",
                     "etc/slsd/patterns/16px-5.toml",
                     "usr/share/slsd/boards/charuco-11x7-23mm-a4.pdf", "usr/share/slsd/monitoring/slsd-alerts.yml",
                     "usr/share/slsd/monitoring/slsd-dashboard.json", "usr/share/man/man1/slsctl.1", "usr/share/man/man8/slsd-display.8", "usr/share/man/man5/slsd.toml.5",
                     "usr/share/man/man8/slsd.8"):
            self.assertTrue((self.root / file).is_file(), file)
        for name in UNITS:
            self.assertNotRegex(self.unit(name), r"@[a-z_]+@", name)
        self.assertIn("ExecStart=/usr/bin/slsd --config /etc/slsd/slsd.toml\n", self.unit("slsd.service"))
        self.assertIn("ExecStart=/usr/bin/slsd --config /etc/slsd/%i.toml\n", self.unit("slsd@.service"))
        self.assertIn("ListenStream=/run/slsd/%i.sock\n", self.unit("slsd@.socket"))
        if DDS_UNITS:
            dds = "ExecStart=/usr/bin/slsd-dds --name {} --socket /run/slsd/{}.sock\n"
            self.assertIn(dds.format("scanner", "slsd"), self.unit("slsd-dds.service"))
            self.assertIn(dds.format("%i", "%i"), self.unit("slsd-dds@.service"))

    def test_brings_the_pages_that_texts_name(self):
        install("/usr", str(self.root))
        pages = self.root / "usr/share/doc/slsd"
        named = {(file, page) for folder in NAMING for file in (SOURCE / folder).rglob("*") if file.is_file()
                 for page in PAGE.findall(file.read_text(encoding="utf-8", errors="ignore"))}
        self.assertTrue(named)
        missing = [f"{file.relative_to(SOURCE)} names {page}" for file, page in named if not (pages / page).is_file()]
        self.assertFalse(missing)
        packaged = (SOURCE / "debian/slsd.install").read_text(encoding="utf-8").split()
        self.assertIn("usr/share/doc/slsd", packaged)
        self.assertRegex((SOURCE / "debian/rules").read_text(encoding="utf-8"), r"dh_compress -X\.md")

    def test_descriptions_of_packages_are_as_wide_as_lintian_allows(self):
        """./run package refuses wider ones, but only after it has built everything."""
        for line in (SOURCE / "debian/control").read_text(encoding="utf-8").splitlines():
            if line.startswith(" "):
                self.assertLessEqual(len(line), 80, line)

    def unit(self, name, prefix="usr"):
        return (self.root / prefix / "lib/systemd/system" / name).read_text(encoding="utf-8")

    def lay_out_for_systemd(self):
        """Besides the units, all that they name, and an instance of the templates."""
        if not shutil.which("systemd-analyze"):
            self.skipTest("no systemd-analyze here (package systemd)")
        install("/usr", str(self.root))
        units = self.root / "usr/lib/systemd/system"
        for kind in ("service", "socket"):
            shutil.copy(units / f"slsd@.{kind}", units / f"slsd@left.{kind}")
        if DDS_UNITS:
            shutil.copy(units / "slsd-dds@.service", units / "slsd-dds@left.service")
        for program in ("usr/lib/xorg/Xorg", "bin/kill", "bin/sh"):
            (self.root / program).parent.mkdir(parents=True, exist_ok=True)
            (self.root / program).write_text("#!/bin/sh\n", encoding="utf-8")
            (self.root / program).chmod(0o755)
        for target in ("sysinit", "basic", "shutdown", "multi-user", "sockets", "network-online", "timers", "time-set", "time-sync"):  # systemd's own, which every unit needs
            (units / f"{target}.target").write_text("[Unit]\n", encoding="utf-8")

    def test_units_are_sound(self):
        self.lay_out_for_systemd()
        names = [name.replace("@", "@left") for name in UNITS]
        verified = subprocess.run(["systemd-analyze", "verify", "--man=no", f"--root={self.root}", *names],
                                  capture_output=True, text=True, check=False)
        self.assertEqual((verified.stdout + verified.stderr, verified.returncode), ("", 0))

    def test_units_have_few_rights(self):
        self.lay_out_for_systemd()
        for name, highest in (("slsd.service", 1.8), ("slsd@left.service", 1.8), ("slsd-display.service", 3.5),
                              ("slsd-web.service", 1.5), ("slsd-tcp.service", 1.5), ("slsd-metrics.service", 2.0), *((unit.replace("@", "@left"), 1.6) for unit in DDS_UNITS)):
            weighed = subprocess.run(["systemd-analyze", "security", "--offline=yes", "--no-pager", f"--root={self.root}", name],
                                     capture_output=True, text=True, check=True).stdout
            exposure = float(re.search(r"Overall exposure level for .*: ([0-9.]+)", weighed).group(1))
            print(f"{name}: exposure {exposure}, at most {highest}")
            self.assertLessEqual(exposure, highest, weighed)

    def test_users_are_as_systemd_reads_them(self):
        if not shutil.which("systemd-sysusers"):
            self.skipTest("no systemd-sysusers here (package systemd)")
        install("/usr", str(self.root))
        (self.root / "etc").mkdir(exist_ok=True)
        subprocess.run(["systemd-sysusers", f"--root={self.root}"], check=True, capture_output=True)
        users = (self.root / "etc/passwd").read_text(encoding="utf-8")
        groups = (self.root / "etc/group").read_text(encoding="utf-8")
        self.assertRegex(users, r"(?m)^slsd:[^\n]*:/var/lib/slsd:/usr/sbin/nologin$")
        for group in ("video", "render", "plugdev"):
            self.assertRegex(groups, rf"(?m)^{group}:.*\bslsd$")
        self.assertRegex(groups, r"(?m)^slsd-admin:")

    def test_programs_follow_the_prefix_and_the_configuration_does_not(self):
        install("/usr/local", str(self.root))
        self.assertIn("ExecStart=/usr/local/bin/slsd --config /etc/slsd/slsd.toml\n", self.unit("slsd.service", "usr/local"))
        self.assertTrue((self.root / "etc/slsd/slsd.toml").is_file())
        self.assertIn("/etc/slsd/slsd.toml", subprocess.run([self.root / "usr/local/bin/slsd", "--help"], check=True,
                                                            capture_output=True, text=True).stdout)

    def help_of(self, *command):
        return subprocess.run([self.root / "usr/bin" / command[0], *command[1:], "--help"], check=True, capture_output=True, text=True).stdout

    def usages(self):
        """Every program, and every command of slsctl."""
        for program in sorted((self.root / "usr/bin").iterdir()):
            yield (program.name,)
            if program.name == "slsctl":
                yield from ((program.name, command) for command in re.findall(r"(?m)^  ([a-z][a-z-]*)  ", self.help_of(program.name)))

    def by_bash(self, line):
        words = line.split(" ")
        script = self.root / "usr/share/bash-completion/completions" / words[0]
        code = (f"source {script}; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; "
                f"_slsd {words[0]} '{words[-1]}' '{words[-2]}'; echo \"${{COMPREPLY[*]}}\"")
        return subprocess.run(["bash", "-c", code], env={"PATH": f"{self.root}/usr/bin:/usr/bin:/bin"}, check=True, cwd=self.root,
                              capture_output=True, text=True).stdout.split()

    def by_fish(self, line):
        folder = self.root / "usr/share/fish/vendor_completions.d"
        code = f"set fish_complete_path {folder}; complete -C '{line}'"
        completed = subprocess.run(["fish", "--no-config", "-c", code], check=True, capture_output=True, text=True, cwd=self.root,
                                   env={"PATH": f"{self.root}/usr/bin:/usr/bin:/bin", "HOME": str(self.root)}).stdout
        return [each.split("\t")[0] for each in completed.splitlines()]

    def check_completion(self, complete):
        install("/usr", str(self.root))
        for line, expected in (("slsctl sta", "status"), ("slsctl scan --dens", "--density"), ("slsd --check-c", "--check-config"),
                               ("slsctl scan --density p", "pixels"), ("slsd --log-level w", "warning"), ("slsctl project foc", "focus"),
                               ("slsctl calibrate --resume ca", "cancel"), ("slsctl --json scan --format t", "tiff")):
            with self.subTest(line=line):
                self.assertEqual(complete(line), [expected])
        self.assertEqual(set(complete("slsctl ")), {usage[1] for usage in self.usages() if len(usage) == 2})
        for usage in self.usages():
            with self.subTest(usage=usage):
                options = set(re.findall(r"(?m)(?:^| |,)(--[a-z][a-z-]*)", self.help_of(*usage)))
                self.assertEqual(set(complete(" ".join((*usage, "--")))), options)

    def test_bash_completes_what_the_help_lists(self):
        self.check_completion(self.by_bash)

    @unittest.skipUnless(shutil.which("fish"), "no fish here (package fish)")
    def test_fish_completes_what_the_help_lists(self):
        self.check_completion(self.by_fish)

    @unittest.skipUnless(shutil.which("zsh"), "no zsh here (package zsh)")
    def test_zsh_completes_what_the_help_lists(self):
        with ZshTerminal(self.root) as zsh:
            self.check_completion(zsh.complete)

    def test_zsh_looks_where_its_completion_is(self):
        install("/usr/local", str(self.root))
        self.assertTrue((self.root / "usr/local/share/zsh/site-functions/_slsctl").is_file())
        if pathlib.Path("/etc/debian_version").exists():
            install("/usr", str(self.root))
            self.assertTrue((self.root / "usr/share/zsh/vendor-completions/_slsctl").is_file())

    def test_leaves_the_administrators_configuration_alone(self):
        file = self.root / "etc/slsd/slsd.toml"
        file.parent.mkdir(parents=True)
        file.write_text("# mine\n", encoding="utf-8")
        install("/usr", str(self.root))
        self.assertEqual(file.read_text(encoding="utf-8"), "# mine\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
