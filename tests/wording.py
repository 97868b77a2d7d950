#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Checks the wording of comments, pages and commits:

- A doc comment starts with the noun or verb of the thing, and not with a clause: "The number of ...", not "How many ...".
- A sentence of README.md or docs/ has 40 words at most.
- The subject of a commit names its place and has 72 characters at most.

wording.txt lists how many each place still has. A place with more fails, and so does one with fewer: then lower its number.
"""
import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXCEPTIONS = pathlib.Path(__file__).with_name("wording.txt")
WORDS_MAX = 40
SUBJECT_MAX = 72
CLAUSE = re.compile(r"(What|Who|Where|When|That|Which|How|As|If|By|Of|In|On|From|To|With|Without|Those|At|Why|Whose|"
                    r"Until|For)\b")


def clause_openings(source):
    """Yields (line number, text) of doc comments above a declaration that start with a clause or a genitive."""
    before = False
    for number, line in enumerate(source.splitlines(), 1):
        comment = re.match(r"\s*///(?!<)\s?(.*)", line)
        if comment and not before and CLAUSE.match(comment[1]):
            yield number, comment[1]
        before = bool(comment)


def sentences(page):
    """Yields the sentences of a page in Markdown: of paragraphs, items of lists, headings and cells of tables."""
    text = re.sub(r"```.*?```", "\n\n", page, flags=re.S)
    text = re.sub(r"\$\$.*?\$\$", "X", text, flags=re.S)
    text = re.sub(r"(?m)(?<=\n\n)(?: {4}.*\n(?:\n(?= {4}))?)+", "\n", text)
    text = re.sub(r"(?m)^(#.*)$", r"\n\1\n", text)
    for block in re.split(r"\n\s*\n", text):
        for item in re.split(r"\n(?=\s*(?:[-*]|\d+\.)\s)|\n(?=\|)|(?<=\|)\n", block):
            for part in item.split("|") if item.lstrip().startswith("|") else [item]:
                part = re.sub(r"^\s*([-*]|\d+\.)\s", "", part)
                part = re.sub(r"\]\([^)]*\)", "]", part).replace("\n", " ")
                yield from (each.strip() for each in
                            re.split(r"(?<=[.!?])[)\"*_`]*\s+(?=[A-Z`\"\[*($0-9])", part) if each.strip())


def long_sentences(page):
    return [each for each in sentences(page) if len(each.split()) > WORDS_MAX]


def bad_subject(subject):
    """What is wrong with the subject of a commit, or None."""
    if len(subject) > SUBJECT_MAX:
        return f"has {len(subject)} characters, more than {SUBJECT_MAX}"
    if not re.match(r"[\w./, *-]+: \S", subject):
        return "names no place: write \"core/decode: reject ...\""
    return "ends in a full stop" if subject.endswith(".") else None


def git(*arguments):
    done = subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else None


def read_exceptions():
    """The commit from whose successors on subjects are checked, and how many findings each place may have."""
    lines = [line.split() for line in EXCEPTIONS.read_text().splitlines() if line and not line.startswith("#")]
    return (next(value for name, value in lines if name == "commits-after"),
            {name: int(value) for name, value in lines if name != "commits-after"})


def find_all(paths):
    """Findings by place: the first folder of a source, or the page."""
    found = collections.defaultdict(list)
    for path in paths:
        if re.search(r"\.[ch]pp$", path) and not path.startswith("tests/"):
            for number, text in clause_openings((ROOT / path).read_text()):
                found[path.split("/")[0]].append(f"{path}:{number}: starts with a clause: {text}")
        elif path == "README.md" or re.match(r"docs/.*\.md$", path):
            for sentence in long_sentences((ROOT / path).read_text()):
                found[path].append(f"{path}: {len(sentence.split())} words in a sentence: {sentence[:60]} ...")
    return found


def compare(found, allowed):
    """Messages: one for each place with more findings than allowed, or fewer."""
    messages = []
    for place in sorted(found.keys() | allowed.keys()):
        count, most = len(found.get(place, ())), allowed.get(place, 0)
        if count > most:
            messages += [f"{place}: {count} findings, {most} allowed"] + [f"  {each}" for each in found[place]]
        elif count < most:
            messages.append(f"{place}: {count} findings: lower its number in {EXCEPTIONS.name} from {most}")
    return messages


def check_subjects(after):
    """Messages on commits since then; none in a checkout whose history does not reach so far back."""
    log = git("log", "--no-merges", "--format=%h %s", f"{after}..HEAD") or ""
    subjects = (line.split(" ", 1) for line in log.splitlines())
    return [f"{commit}: the subject {fault}: {subject}" for commit, subject in subjects if (fault := bad_subject(subject))]


def check():
    after, allowed = read_exceptions()
    return compare(find_all((git("ls-files") or "").splitlines()), allowed) + check_subjects(after)


if __name__ == "__main__":
    faults = check()
    print("\n".join(faults), file=sys.stderr)
    sys.exit(1 if faults else 0)
