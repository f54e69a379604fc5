"""Check names and prose: words, openings and lengths of sentences that the project does not use.

Usage: python tests/checks/prose.py [--root FOLDER] [--longest N]

Prints ``file:line: rule: text`` for each offence in sigdb, docs and README.md, and ends with 1 if there is any. With
``--longest``, prints the longest sentences of docstrings and docs instead.
"""

import argparse
import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

NAMES = {"one", "found", "told", "said", "asked", "given", "made", "known", "own", "beside"}
"""Names that say nothing of what they hold."""

PARTS_OF_NAMES = {"told", "said", "asked", "beside", "judged", "judge"}
"""Words that no part of a name is."""

WORDS = re.compile(
    r"\b(told|tells|said|asked|beside|judges?|(?<!cannot be )judged|judging|figures? of merit|merits?)\b", re.IGNORECASE
)
"""Words that prose does not use; a recording may be such that its gear cannot be judged."""

OPENINGS = {"page": re.compile(r"Of\s|What\s.*\sof\s")}
OPENINGS |= dict.fromkeys(("docstring", "message"), re.compile(r"(?:Of|What)\s"))
"""Beginnings of sentences that prose does not use, unless they are questions; on pages headings may begin so."""

MOST_WORDS = 45
"""Greatest number of words in a sentence of a docstring, a comment or a page; a message may hold a query."""

QUOTED = re.compile(r"``.+?``|`[^`]+`|:\w+:`[^`]+`|\$\$.+?\$\$|\$[^$\n]+\$|\[@[^\]]*\]|https?://\S+", re.DOTALL)
SENTENCE_END = re.compile(
    r"(?<!\b[A-Z])(?<!et al)(?<!\be\.g)(?<!\bi\.e)(?<!\bEq)(?<!\bno)[.!?:][)\"*_]*\s+(?=[\"'(*_]*[A-Z0-9])"
)


@dataclass(frozen=True)
class Text:
    """A paragraph, a message or a comment, with code and formulas replaced by CODE.

    Attributes
    ----------
    kind
        ``docstring``, ``message``, ``comment`` or ``page``.
    """

    file: Path
    line: int
    kind: str
    text: str

    @property
    def sentences(self) -> list[str]:
        """Sentences without line breaks."""
        return [part.strip() for part in SENTENCE_END.split(" ".join(self.text.split())) if part.strip()]


@dataclass(frozen=True)
class Offence:
    """A name or a sentence that breaks a rule."""

    file: Path
    line: int
    rule: str
    text: str


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--root", type=Path, default=Path(__file__).parents[2], help="folder with sigdb, docs, README.md"
    )
    parser.add_argument("--longest", type=int, help="print so many of the longest sentences instead")
    options = parser.parse_args()
    if options.longest:
        for words, text in longest(options.root, options.longest):
            print(f"{words:3d} words  {text.file.relative_to(options.root)}:{text.line}: {' '.join(text.text.split())}")
        return 0
    offences = sorted(check(options.root), key=lambda offence: (offence.file, offence.line))
    for offence in offences:
        print(f"{offence.file.relative_to(options.root)}:{offence.line}: {offence.rule}: {offence.text}")
    counts = Counter("/".join(offence.file.relative_to(options.root).parts[:2]) for offence in offences)
    print(
        f"{len(offences)} offences",
        *(f"{name} {count}" for name, count in counts.most_common()),
        sep="\n  ",
        file=sys.stderr,
    )
    return 1 if offences else 0


def check(root: Path) -> Iterator[Offence]:
    """Offences of the names and the prose below a folder."""
    for path in sorted((root / "sigdb").rglob("*.py")):
        yield from wrong_names(path)
    for text in texts(root):
        yield from wrong_prose(text)


def wrong_prose(text: Text) -> Iterator[Offence]:
    """Words, openings and lengths of sentences in a text that the project does not use."""
    for sentence in text.sentences:
        words = len(sentence.split())
        if words > MOST_WORDS and text.kind != "message":
            yield Offence(text.file, text.line, f"{words} words in a sentence", _shortened(sentence))
        for match in WORDS.finditer(sentence):
            yield Offence(text.file, text.line, f"word '{match.group()}'", _shortened(sentence))
        opening = OPENINGS.get(text.kind)
        if opening and opening.match(sentence.lstrip("\"'(*_#|- ")) and not text.text.endswith("?"):
            yield Offence(text.file, text.line, "opening", _shortened(sentence))


def longest(root: Path, count: int) -> list[tuple[int, Text]]:
    """The longest sentences of docstrings and pages, with their numbers of words."""
    found = [
        (len(sentence.split()), Text(text.file, text.line, text.kind, sentence))
        for text in texts(root)
        if text.kind in ("docstring", "page")
        for sentence in text.sentences
    ]
    return sorted(found, key=lambda pair: -pair[0])[:count]


def texts(root: Path) -> Iterator[Text]:
    """The prose of the sources, of the pages and of README.md."""
    for path in sorted((root / "sigdb").rglob("*.py")):
        yield from source_texts(path)
    for path in [*sorted((root / "docs").rglob("*.md")), root / "README.md"]:
        if path.is_file() and "_build" not in path.parts and "generated" not in path.parts:
            yield from page_texts(path)


def wrong_names(path: Path) -> Iterator[Offence]:
    """Names that a file defines and the project does not use."""
    if _is_banned(path.stem):
        yield Offence(path, 1, "name", path.stem)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        for name in _defined(node):
            if _is_banned(name):
                yield Offence(path, getattr(node, "lineno", 1), "name", name)


def _is_banned(name: str) -> bool:
    plain = name.strip("_").lower()
    return plain in NAMES or not PARTS_OF_NAMES.isdisjoint(plain.split("_"))


def _defined(node: ast.AST) -> Iterator[str]:
    """Names that a node of the syntax tree defines."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            yield node.name
        case ast.arg():
            yield node.arg
        case ast.Name(ctx=ast.Store()):
            yield node.id
        case ast.Attribute(ctx=ast.Store()):
            yield node.attr
        case ast.alias(asname=str(name)):
            yield name


def source_texts(path: Path) -> Iterator[Text]:
    """Docstrings, messages and comments of a source file."""
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    documentation = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    }
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if id(node) in documentation:
            yield from _paragraphs(path, node.lineno, node.value)
        elif isinstance(node, ast.JoinedStr):
            parts = [part.value if isinstance(part, ast.Constant) else "CODE" for part in node.values]
            yield Text(path, node.lineno, "message", _plain("".join(parts)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            yield Text(path, node.lineno, "message", _plain(node.value if " " in node.value else ""))
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text(path, token.start[0], "comment", _plain(token.string.lstrip("# ")))


def _paragraphs(path: Path, first: int, docstring: str) -> Iterator[Text]:
    """Paragraphs of a docstring, without examples and references."""
    lines = docstring.splitlines()
    block: list[str] = []
    start, indent, section, example = first, -1, "", False
    for number, line in enumerate([*lines, ""], first):
        stripped = line.strip()
        example = (example and bool(stripped)) or stripped.startswith((">>>", "..."))
        if re.fullmatch(r"[-=][-= ]+[-=]", stripped):
            section, block = (block[-1].strip() if block else section), []
            continue
        here = len(line) - len(line.lstrip())
        breaks = (
            not stripped
            or example
            or stripped.startswith(("- ", "* ", ".. "))
            or (here != indent and number > first + 1)
        )
        if breaks and block:
            if section != "References":
                yield Text(path, start, "docstring", _plain("\n".join(block)))
            block = []
        if stripped and not example:
            if not block:
                start = number
            block.append(stripped.lstrip("-* "))
            indent = here


def page_texts(path: Path) -> Iterator[Text]:
    """Paragraphs, headings, items and table cells of a page, without code."""
    block: list[str] = []
    start, fence = 1, ""
    for number, line in enumerate([*path.read_text(encoding="utf-8").splitlines(), ""], 1):
        stripped = line.strip()
        mark = re.match(r"(```+|~~~+|\$\$)", stripped)
        if fence or mark:
            if (fence and stripped.endswith(fence)) or (not fence and mark and stripped.count("$$") == 2):
                fence = ""
            elif not fence and mark:
                fence = mark.group()
            stripped = ""
        cells = [cell.strip() for cell in stripped.strip("|").split(" | ")] if stripped.startswith("|") else []
        if block and (not stripped or cells or re.match(r"(#+|[-*>]|\d+\.|!\[|\([\w-]+\)=)\s?", stripped)):
            yield Text(path, start, "page", _plain("\n".join(block)))
            block = []
        for cell in cells:
            yield Text(path, number, "page", _plain(cell))
        if stripped and not cells:
            if not block:
                start = number
            block.append(re.sub(r"^(#+|[-*>]|\d+\.)\s+", "", stripped))
            if stripped.startswith("#"):
                yield Text(path, start, "page", _plain("\n".join(block)))
                block = []


def _plain(text: str) -> str:
    """A text with code, formulas and addresses replaced by CODE, and links by their words."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return QUOTED.sub("CODE", text)


def _shortened(text: str) -> str:
    return text if len(text) <= 110 else text[:107] + "..."


if __name__ == "__main__":
    sys.exit(main())
