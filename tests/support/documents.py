"""What the documents tell a reader to run: blocks of commands and programs, and commands in a
sentence.

A page says "Not run by the checks" in the sentence with a command, or in the paragraph above its
block, list or table, which then ends with a colon.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.support.places import ROOT

PAGES = sorted(
    [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    + [page for folder in ("examples", "tables") for page in (ROOT / folder).glob("*.md")]
)
MANIFESTS = [ROOT / "Dockerfile", *sorted((ROOT / "deploy").glob("*.yaml"))]
NOT_RUN = "not run by the checks"
#: what begins a command in a sentence, in an indented block or in a comment
PROGRAMS = {
    "mumacro", "python", "python3", "pip", "uv", "uvx", "npx", "docker", "podman", "kubectl",
    "curl", "git", "bash", "sh", "make", "cmake", "cc", "clang", "gcc", "g++", "gfortran", "zig",
    "x86_64-w64-mingw32-gcc", "mkoctfile", "octave", "octave-cli", "node",
}  # fmt: skip
#: a fenced block, or lines without an empty one between them
PART = re.compile(
    r"^```(?P<language>\S*).*\n(?P<text>(?s:.*?))^```$|(?P<prose>(?:^(?!```).*\S.*\n?)+)",
    re.MULTILINE,
)
ITEM = re.compile(r"^(?=\s*(?:[-*] |\d+\. |\|))", re.MULTILINE)
SPAN = re.compile(r"`([^`\n]+)`")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page; ``line`` is that of its fence, from 1."""

    page: Path
    line: int
    language: str
    text: str
    marked: bool

    def entries(self) -> list[tuple[str, str]]:
        """Each command of a shell's block, with what the page shows below it."""
        if self.language == "console":
            result = re.split(r"^\$ ", self.text, flags=re.MULTILINE)[1:]
            return [(command, shown) for command, _, shown in (x.partition("\n") for x in result)]
        return [(line, "") for line in self.text.splitlines() if line.strip()]


@dataclass(frozen=True)
class Mention:
    """A command outside of the fenced blocks."""

    page: Path
    line: int
    command: str
    marked: bool
    indented: bool = False


def plain(command: str) -> str:
    """A command without the comment at its end."""
    return re.sub(r"\s+# .*$", "", command.strip())


def is_command(text: str) -> bool:
    """Whether it begins with a program and says more than its name."""
    program, _, rest = text.strip().removeprefix("nice ").partition(" ")
    return program in PROGRAMS and bool(rest)


def says(text: str) -> bool:
    return NOT_RUN in " ".join(text.split()).lower()


def parts(page: Path) -> Iterator[tuple[re.Match[str], int, bool]]:
    """Blocks and paragraphs of a page in their order, with their lines, and whether the paragraph
    above says that they are not run."""
    text, above = page.read_text("utf-8"), ""
    for result in PART.finditer(text):
        line = text.count("\n", 0, result.start()) + 1
        yield result, line, above.rstrip().endswith(":") and says(above)
        above = result["prose"] or ""


def blocks(page: Path, *languages: str) -> list[Block]:
    """The fenced blocks of a page, of these languages."""
    result = [
        Block(page, line, part["language"], part["text"], marked)
        for part, line, marked in parts(page)
        if part["prose"] is None
    ]
    return [block for block in result if block.language in languages or not languages]


def mentions(page: Path) -> list[Mention]:
    """Commands in sentences, lists and tables of a page, and in its indented blocks."""
    result = []
    for part, first, marked in parts(page):
        line = first
        for item in ITEM.split(part["prose"] or ""):
            for i, row in enumerate(item.splitlines()):
                indented = row.startswith("    ")
                commands = [row] if indented else SPAN.findall(row)
                result += [
                    Mention(page, line + i, plain(command), marked or says(item), indented)
                    for command in commands
                    if is_command(command)
                ]
            line += item.count("\n")
    return result


def comments(manifest: Path) -> list[Mention]:
    """Commands in the comments of a manifest, which says at its head that they are not run."""
    text = manifest.read_text("utf-8")
    head = re.sub(r"^#", "", "".join(re.findall(r"^#.*\n", text, re.MULTILINE)), flags=re.MULTILINE)
    return [
        Mention(manifest, i, command, says(head))
        for i, line in enumerate(text.splitlines(), 1)
        if line.lstrip().startswith("#")
        for command in (line.lstrip(" #"), *SPAN.findall(line))
        if is_command(command)
    ]
