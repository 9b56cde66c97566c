"""Words of the site: how many there are, and which of them docs/developers/style.md bans.

`python -m docs.words` lists the pages of the site's menu with their words of prose, and every
banned word that a user may read. It ends with code 1 where a limit is passed or a word is banned.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
MOST_PAGES, MOST_WORDS = 30, 15_000  # of the pages that the menu of the site lists

# What is banned where a user reads, and what stands in its place.
BANNED = {
    r"tell|tells|telling|told": "show, state, determine, distinguish",
    r"foretell|foretold": "predict",
    r"dear|dearer|dearest": "costly",
    r"left out|leav(?:e|es|ing) (?:\w+ ){0,3}out": "omit",
    r"unloading ratio": "ratio of unloading to loading stiffness",
    r"(?<!stability )multiplier": "stability multiplier",
    r"error of (?:the|a) grid|grid error|error by the resolution": "discretisation error",
    r"blows? (?:a|in a) minute": "blows per minute",
    r"(?<!divided )by (?:that|those) (?:of|before)": "divided by",
}
BANNED_WORDS = re.compile("|".join(rf"\b(?:{word})\b" for word in BANNED), re.IGNORECASE)

# Folders and files whose strings a user may read: help, messages, descriptions, tables.
_SOURCES = ("percussion_model", "fmu_src", "scenarios", "build.py")


def menu() -> list[Path]:
    """Pages that the menu of the site lists, by the toctrees of docs/index.md."""
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = [DOCS / "index.md"]
    for block in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL):
        for line in block.splitlines():
            if line and not line.startswith(":"):
                name = line.removesuffix(">").rpartition("<")[2].strip()
                pages += sorted(DOCS.glob(f"{name}.md"))
    return pages


def prose(text: str) -> str:
    """Text without code, equations, tables and what scripts write; a formula is one word."""
    for block in (
        r"\A---\n.*?\n---\n",
        r"<!-- begin.*?<!-- end -->",
        r"<!-- (\w+) -->.*?<!-- end of \1 -->",
        r"```.*?```|\$\$.*?\$\$",
    ):
        text = re.sub(block, "", text, flags=re.DOTALL)
    text = re.sub(r"^(?:\s*\||    ).*$", "", text, flags=re.MULTILINE)
    return re.sub(r"\$[^$]+\$", "formula", text)


def count(page: Path) -> int:
    """Words of prose of a page."""
    words = prose(page.read_text(encoding="utf-8")).split()
    return sum(bool(re.search(r"[A-Za-z0-9]", word)) for word in words)


def strings(file: Path) -> Iterator[tuple[int, str]]:
    """Lines and strings of two words and more of a source, without its docstrings."""
    nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    bodies = [node.body for node in nodes if isinstance(node, documented) and node.body]
    described = {id(body[0].value) for body in bodies if isinstance(body[0], ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = "" if id(node) in described else node.value
            yield from [(node.lineno, text)] * (" " in text)


def read_by_users() -> Iterator[tuple[str, str]]:
    """Places and texts that a user may read: pages, strings of the program, its data."""
    for page in [*DOCS.rglob("*.md"), ROOT / "README.md"]:
        if page.parent.name != "developers":
            text = re.sub(r"`[^`\n]+`", "", page.read_text(encoding="utf-8"))
            for number, line in enumerate(text.splitlines(), 1):
                yield f"{page.relative_to(ROOT)}:{number}", line
    for source in map(ROOT.joinpath, _SOURCES):
        for file in [source] if source.is_file() else source.rglob("*.py"):
            for number, text in strings(file):
                yield f"{file.relative_to(ROOT)}:{number}", text
        for file in source.rglob("*.toml"):
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                for text in re.findall(r'"[^"]*"', line.partition("#")[0]):
                    yield f"{file.relative_to(ROOT)}:{number}", text


def banned() -> list[str]:
    """Banned words that users may read, each with its place."""
    return [
        f"{place}: {found[0]}"
        for place, text in read_by_users()
        for found in BANNED_WORDS.finditer(text)
    ]


def main() -> int:
    """Print words page by page, and what is wrong."""
    pages = menu()
    for page in pages:
        print(f"{count(page):6d}  {page.relative_to(ROOT)}")
    total, wrong = sum(map(count, pages)), banned()
    print(f"{total:6d}  words on {len(pages)} pages; at most {MOST_WORDS} on {MOST_PAGES}")
    print(*wrong, sep="\n")
    return int(bool(wrong) or total > MOST_WORDS or len(pages) > MOST_PAGES)


if __name__ == "__main__":
    sys.exit(main())
