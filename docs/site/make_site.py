#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Makes pages of the documentation and the manual, to be read without a network: make_site.py FOLDER."""
import html
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.append("/usr/lib/python3/dist-packages")  # Debian's package, for whichever Python runs this
import markdown

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGES = {
    "Begin": {"README.md": "slsd", "docs/installing.md": "Installing", "docs/hardware.md": "Cameras", "docs/projector.md": "Projector",
              "docs/calibration.md": "Calibrating", "docs/page.md": "The page"},
    "Use": {"docs/tasks.md": "Tasks", "docs/configuration.md": "Configuration", "docs/dense.md": "Dense clouds", "docs/model.md": "Models", "docs/formats.md": "File formats",
            "docs/protocol.md": "Protocol", "clients/python/README.md": "Python", "clients/cpp/README.md": "C++",
            "docs/examples.md": "Examples", "docs/controllers.md": "Controllers", "docs/ros.md": "ROS 2", "clients/ros/README.md": "ROS 2 launch file",
            "docs/robot.md": "Robots", "docs/datasheet.md": "Data sheet", "docs/fleet.md": "Many scanners"},
    "Run": {"docs/supervision.md": "Supervision", "docs/metrics.md": "Metrics"},
    "Understand": {"docs/decoder.md": "The decoder", "docs/reasons.md": "Reasons", "docs/alphabet.md": "The alphabet", "docs/arrays.md": "The arrays",
                   "docs/architecture.md": "Architecture", "docs/glossary.md": "Glossary", "docs/developing.md": "Developing",
                   "tests/corpus/README.md": "The corpus", "CHANGELOG.md": "Changes"},
}
TEXT_ENDINGS = {".toml", ".hpp", ".cpp", ".c", ".script", ".py", ""}  # shown as they are


def pages():
    """Each page of the site: where it comes from, its title and its file."""
    for group, files in PAGES.items():
        for source, title in files.items():
            yield group, source, title, file_of(source)
    for source in sorted((SOURCE / "docs/notes").glob("*.md")):
        title = source.read_text(encoding="utf-8").split("\n", 1)[0].removeprefix("# ")
        yield "Notes", f"docs/notes/{source.name}", title, file_of(f"docs/notes/{source.name}")
    for source in sorted((SOURCE / "man").glob("*.[1-9]")):
        yield "Manual", f"man/{source.name}", f"{source.stem}({source.suffix[1:]})", f"man/{source.name}.html"


def file_of(source):
    if source == "README.md":
        return "index.html"
    name = source.removeprefix("docs/").removesuffix(".md").removesuffix("/README").replace("/", "-").lower()
    return f"{name}.html"


def slug(text, _separator):
    """The anchors of headings, as GitHub makes them."""
    return re.sub(r"[^\w\- ]", "", html.unescape(text).strip().lower()).replace(" ", "-")


class Site:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.files = {source: file for _, source, _, file in pages()}

    def link(self, source, target):
        """Where a link of a source leads within the site; None: nowhere."""
        if re.match(r"[a-z]+:|#", target):
            return target
        path, _, anchor = target.partition("#")
        found = (SOURCE / source).parent.joinpath(path).resolve()
        known = str(found.relative_to(SOURCE))
        if known in self.files:
            return self.files[known] + ("#" + anchor if anchor else "")
        if not found.is_file():
            return None
        name = known.removeprefix("docs/") + (".txt" if found.suffix in TEXT_ENDINGS else "")
        (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(found, self.folder / name)
        return name

    def body(self, source):
        if source.startswith("man/"):
            made = subprocess.run(["mandoc", "-T", "html", "-O", "fragment", SOURCE / source], check=True,
                                  capture_output=True, text=True).stdout
            return re.sub(r"<b>(sls[a-z.-]+)</b>\((\d)\)", self.manual_link, made)
        text = (SOURCE / source).read_text(encoding="utf-8")
        made = markdown.markdown(text, extensions=["tables", "fenced_code", "toc", "sane_lists"],
                                 extension_configs={"toc": {"slugify": slug}})
        made = made.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")

        def replace(match):
            target = self.link(source, html.unescape(match[2]))
            return f'{match[1]}="{html.escape(target)}"' if target else "data-elsewhere"
        return re.sub(r'(href|src)="([^"]*)"', replace, made)

    def manual_link(self, match):
        name = f"{match[1]}.{match[2]}"
        return f'<a href="{name}.html">{match[0]}</a>' if f"man/{name}" in self.files else match[0]

    def write(self):
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        shutil.copy(pathlib.Path(__file__).parent / "site.css", self.folder)
        for _, source, title, file in pages():
            up = "../" * file.count("/")
            target = self.folder / file
            target.parent.mkdir(exist_ok=True)
            target.write_text(f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}{"" if title == "slsd" else " · slsd"}</title>
<link rel="stylesheet" href="{up}site.css">
<header><a href="{up}index.html">slsd</a> <a href="#contents">Contents</a></header>
<main>{self.body(source)}</main>
<nav id="contents">{self.navigation(file, up)}</nav>
</html>
""", encoding="utf-8")

    @staticmethod
    def navigation(current, up):
        lines, last = [], None
        for group, _, title, file in pages():
            if group != last:
                lines.append(f"<h2>{group}</h2>")
                last = group
            here = ' aria-current="page"' if file == current else ""
            lines.append(f'<a href="{up}{file}"{here}>{html.escape(title)}</a>')
        return "\n".join(lines)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    Site(sys.argv[1]).write()
