#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""A program against the installed C++ library, as its users build one: cpp_install_test.py CMAKE BUILD_DIR."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD = sys.argv[1:3]
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "clients/python"), str(HERE.parent / "daemon")]

import slsd  # noqa: E402
from service import Service  # noqa: E402


def run(*command, **environment):
    done = subprocess.run([str(word) for word in command], env={**os.environ, **environment}, capture_output=True,
                          text=True, timeout=300, check=False)
    return done.returncode, done.stdout, done.stderr


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="slsd-test-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.root = pathlib.Path(cls.folder.name)
        cls.prefix = cls.root / "prefix"
        done = run(CMAKE, "--install", BUILD, "--prefix", cls.prefix, "--component", "slsd-dev", DESTDIR="")
        assert done[0] == 0, done
        cls.service = Service().start()
        cls.addClassCleanup(cls.service.__exit__)
        cls.environment = {"SLSD_SOCKET": str(cls.service.socket)}

    def works(self, program):
        status, out, error = run(program, **self.environment)
        self.assertEqual((status, error), (0, ""))
        with slsd.Scanner(self.service.socket) as scanner:
            points = scanner.scan().points
        self.assertEqual(out, f"{len(points)} points, {points['z'].astype(float).mean():.3f} mm away\n"
                              "3 clouds of the same size\n")

    def test_is_found_by_cmake(self):
        build = self.root / "build"
        for command in ((CMAKE, "-S", HERE / "installed", "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}"),
                        (CMAKE, "--build", build)):
            done = run(*command)
            self.assertEqual(done[0], 0, done)
        self.works(build / "example")

    def test_is_found_by_pkg_config(self):
        status, flags, error = run("pkg-config", "--cflags", "--libs", "slsd",
                                   PKG_CONFIG_PATH=str(next(self.prefix.rglob("slsd.pc")).parent))
        self.assertEqual((status, error), (0, ""))
        program = self.root / "example"
        done = run(os.environ.get("CXX", "c++"), "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
                   HERE / "installed/example.cpp", "-o", program, *flags.split())
        self.assertEqual(done, (0, "", ""))
        self.works(program)

    def test_its_headers_need_the_standard_library_alone(self):
        headers = sorted(self.prefix.glob("include/slsd/*.hpp"))
        self.assertGreater(len(headers), 2)
        for header in headers:
            for line in header.read_text(encoding="utf-8").splitlines():
                if line.startswith("#include"):
                    self.assertRegex(line, r'<[a-z_]+>|"slsd/[a-z]+\.hpp"')

    def test_a_service_that_is_not_there_is_told(self):
        program = self.root / "lonely"
        flags = ["-I", self.prefix / "include", next(self.prefix.rglob("libslsd.*"))]
        done = run(os.environ.get("CXX", "c++"), "-std=c++20", HERE / "installed/example.cpp", "-o", program, *flags)
        self.assertEqual(done[0], 0, done)
        status, _, error = run(program, SLSD_SOCKET="/nonexistent/slsd.sock")
        self.assertEqual(status, 1)
        self.assertIn("not_found: no service answers", error)

    def test_the_first_program_of_its_readme_works_word_for_word(self):
        readme = (HERE.parents[1] / "clients/cpp/README.md").read_text(encoding="utf-8")
        source, program = self.root / "robot.cpp", self.root / "robot"
        source.write_text(readme.split("```cpp\n")[1].split("```")[0], encoding="utf-8")
        command = next(line.strip() for line in readme.splitlines() if line.strip().startswith("c++ "))
        done = subprocess.run(["sh", "-c", f"{command} -o robot"], cwd=self.root, capture_output=True, text=True, timeout=300, check=False,
                              env={**os.environ, "PKG_CONFIG_PATH": str(next(self.prefix.rglob("slsd.pc")).parent)})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        status, out, error = run(program, **self.environment)
        self.assertEqual((status, error), (0, ""))
        with slsd.Scanner(self.service.socket) as scanner:
            self.assertEqual(len(out.splitlines()), len(scanner.scan()))
        status, out, error = run(program, SLSD_SOCKET="/nonexistent/slsd.sock")
        self.assertEqual((status, out), (1, ""))
        self.assertRegex(error, r"^/nonexistent/slsd.sock: no service answers there: start slsd .*\n$")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
