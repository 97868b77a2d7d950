#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Breaks a folder's sources on purpose, one place at a time, and lists what the folder's tests do not notice.

Gates, limits and formulas are loosened, left out, doubled or turned round in a copy of the checkout, which is built and
tested; the checkout itself stays as it is. Exit status 1 where a change passed that tests/mutate_passes.txt does not
name with its reason.
"""
import argparse
import hashlib
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PASSES = ROOT / "tests" / "mutate_passes.txt"

NUMBER = r"(\d+\.\d+(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+|\d+)(F?)(?![\w.])"


def scaled(match, factor):
    text = match.group(2)
    if re.fullmatch(r"\d+", text):
        value = str(round(int(text) * factor))
    else:
        value = repr(float(text) * factor)
    return value + match.group(3)


def numbers(line):
    """A named limit, or a default of an option, doubled and halved: each of a line."""
    if not re.search(r"\bconstexpr\b.*=|^\s+[\w:<>]+ \w+ = [\d.]+F?;", line):
        return
    for match in re.finditer(r"(\w+) = -?" + NUMBER, line):
        name, number = match.group(1), match.group(2) + match.group(3)
        if float(match.group(2)) == 0:
            continue
        for factor, how in ((2, "doubled"), (0.5, "halved")):
            changed = scaled(match, factor)
            if changed != number:
                yield f"{name} {how}", line[:match.start(2)] + changed + line[match.end():]


def conditions(line):
    """A rejection or an early end left out, or taken always."""
    match = re.match(r"(\s*(?:\} else )?if )\((.+)\)( (?:return|continue|break|\{).*)$", line)
    if match and not re.search(r"constexpr", line) and match.group(2).count("(") == match.group(2).count(")") \
            and ";" not in match.group(2) and "= " not in re.sub(r"[<>=!]= ", "", match.group(2)):
        yield "condition left out", f"{match.group(1)}(false && ({match.group(2)})){match.group(3)}"


def comparisons(line):
    for match in re.finditer(r" (<=|>=|<|>|==|!=) ", line):
        if re.search(r"template|#include|<[\w:]+>|for \(", line):
            continue
        turned = {"<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "=="}[match.group(1)]
        yield f"{match.group(1)} became {turned}", line[:match.start(1)] + turned + line[match.end(1):]
        return


def signs(line):
    """A term of a formula with the other sign, or with a factor of two."""
    if not re.search(r"[=(].*[a-z_\])] [-+*/] [a-z_(\d]", line) or re.search(r"std::string|template|\"|&&|\|\|", line):
        return
    match = re.search(r"(?<=[\w)\]]) ([-+]) (?=[\w(])", line)
    if match:
        other = "-" if match.group(1) == "+" else "+"
        yield f"{match.group(1)} became {other}", line[:match.start(1)] + other + line[match.end(1):]
    match = re.search(r"(?<=[\w)\]]) (\*) (?=[\w(])", line)
    if match:
        yield "product doubled", line[:match.start(1)] + "* 2 *" + line[match.end(1):]


KINDS = (numbers, conditions, comparisons, signs)


def places(folder):
    """All changes that can be made: file, line number, what, the changed line."""
    for path in sorted((ROOT / folder).rglob("*.[ch]pp")):
        for number, line in enumerate(path.read_text().split("\n")):
            code = line.split("//")[0].rstrip()
            if not code.strip() or code.lstrip().startswith(("#", "*", "static_assert", "assert")):
                continue
            for kind in KINDS:
                for what, changed in kind(code):
                    yield path.relative_to(ROOT), number, kind.__name__, what, changed


def chosen(folder, count, seed):
    """As many of each kind and file as there are places to choose."""
    generator = random.Random(seed)
    groups = {}
    for place in places(folder):
        groups.setdefault((place[0], place[2]), []).append(place)
    for group in groups.values():
        generator.shuffle(group)
    order = sorted(groups)
    generator.shuffle(order)
    taken = []
    while len(taken) < count and any(groups.values()):
        for key in order:
            if groups[key] and len(taken) < count:
                taken.append(groups[key].pop())
    return taken


def test_targets(folder):
    """The programs that test a room: those of its folder under tests/, for the decoder with rendered and misleading
    frames."""
    targets = []
    for part in [pathlib.Path(folder), *pathlib.Path(folder).parents]:
        lists = ROOT / "tests" / part / "CMakeLists.txt"
        if lists.exists():
            targets += [name + "_tests" for name in re.findall(r"slsd_add_tests\((\w+)", lists.read_text())]
            break
    if "decode" in folder:
        targets = ["recorded_tests", *targets, "corpus_tests", "adversary_tests"]  # what notices soonest comes first
    return targets


def run(command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def failed_test(program, folder, seconds):
    """Runs a test program in as many shards as there are processors. None where all pass, else what failed first."""
    shards = os.cpu_count() or 1
    running, logs = [], []
    for shard in range(shards):
        logs.append(tempfile.TemporaryFile("w+"))
        part = {"GTEST_TOTAL_SHARDS": str(shards), "GTEST_SHARD_INDEX": str(shard)}
        running.append(subprocess.Popen([str(program), "--gtest_brief=1", "--gtest_fail_fast"], cwd=folder,
                                        stdout=logs[-1], stderr=subprocess.STDOUT, env=os.environ | part))
    try:
        deadline = time.monotonic() + seconds
        while True:
            states = [process.poll() for process in running]
            for state, log in zip(states, logs):
                if state:
                    log.seek(0)
                    failed = re.search(r"\[  FAILED  \] ([\w/.]+)", log.read())
                    return failed.group(1) if failed else f"{program.name}: ended by status {state}"
            if None not in states:
                return None
            if time.monotonic() > deadline:
                return f"{program.name}: no end in {seconds} s"
            time.sleep(0.1)
    finally:
        for process, log in zip(running, logs):
            process.kill()
            process.wait()
            log.close()


def copy_checkout(copy):
    copy.mkdir(parents=True, exist_ok=True)
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    for name in filter(None, listed):
        source, target = ROOT / name, copy / name
        if not source.exists():
            continue
        text = source.read_bytes()
        if target.exists() and target.read_bytes() == text:
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
        shutil.copymode(source, target)


def verdict(copy, targets, seconds):
    """None where every test passed, else what noticed."""
    status, text = run(["cmake", "--build", "--preset", "release", "--target", *targets], copy)
    if status != 0:
        return "the compiler" if "error:" in text else "the build"
    for target in targets:
        failed = failed_test(copy / "build" / "release" / "bin" / target, copy, seconds)
        if failed is not None:
            return failed
    return None


def name_of(path, number, what):
    return f"{path}: {what}: " + (ROOT / path).read_text().split("\n")[number].strip()


def known_passes(folder):
    """Those of a folder that mutate_passes.txt names. Says which of them the sources no longer have."""
    lines = PASSES.read_text().split("\n")
    named = {line.split("  #")[0].strip() for line in lines if line.startswith(folder + "/")}
    for name in sorted(named - {name_of(path, number, what) for path, number, _, what, _ in places(folder)}):
        print(f"tests/{PASSES.name} names what is not there: {name}", flush=True)
    return named


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="core/decode, for one")
    parser.add_argument("--places", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true", help="the places alone")
    options = parser.parse_args()
    folder = options.folder.rstrip("/")
    if not (ROOT / folder).is_dir():
        parser.error(f"{folder} is no folder of the checkout")
    taken = chosen(folder, options.places, options.seed)
    if options.list:
        for path, number, _, what, changed in taken:
            print(f"{path}:{number + 1}: {what}: {changed.strip()}")
        return 0
    targets = test_targets(folder)
    if not targets:
        parser.error(f"tests/{folder} has no tests")
    copy = ROOT / "build" / "mutate" / hashlib.sha1(folder.encode()).hexdigest()[:8]
    copy_checkout(copy)
    print(f"building {' '.join(targets)} unchanged", flush=True)
    status, text = run(["cmake", "--preset", "release", "-DSLSD_UNITY=OFF"], copy)
    begun = verdict(copy, targets, 900) if status == 0 else text
    if begun is not None:
        sys.exit(f"the unchanged sources do not pass: {begun}")
    passes, unnoticed = known_passes(folder), []
    for index, (path, number, _, what, changed) in enumerate(taken):
        target = copy / path
        original = target.read_text()
        lines = original.split("\n")
        name = name_of(path, number, what)
        lines[number] = changed
        target.write_text("\n".join(lines))
        noticed = verdict(copy, targets, 900)
        target.write_text(original)
        if noticed is None and name not in passes:
            unnoticed.append(name)
        tail = f"noticed by {noticed}" if noticed else "passes" + ("" if name in unnoticed else ", as listed")
        print(f"{index + 1:3} {path}:{number + 1} {what}: {tail}", flush=True)
    print(f"{len(taken)} places, {len(unnoticed)} passed unnoticed")
    for name in unnoticed:
        print(name)
    return 1 if unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
