# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""The blocks of a Markdown page that a reader copies: programs for a shell or Python, and sessions with what they print."""
import dataclasses
import re

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclasses.dataclass
class Block:
    page: str
    line: int  # of its first line
    language: str
    text: str

    @property
    def place(self):
        return f"{self.page}:{self.line}"


def blocks_of(page, text):
    return [Block(page, text.count("\n", 0, match.start()) + 2, match[1], match[2]) for match in FENCE.finditer(text)]


def session_of(text):
    """Of a session: each command after a "$ ", and the lines that it should print."""
    steps = []
    for line in text.splitlines():
        if line.startswith("$ "):
            steps.append((line[2:], []))
        else:
            steps[-1][1].append(line)
    return steps


def fits(expected, printed):
    """Whether the expected lines are printed, in this order; "..." stands for anything."""
    lines = iter(printed.splitlines())
    return all(any(re.fullmatch(re.escape(wanted).replace(r"\.\.\.", ".*"), line) for line in lines) for wanted in expected)
