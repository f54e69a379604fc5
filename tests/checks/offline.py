"""Check built pages: whatever they load lies in their own folder, so that they are read without a network.

Usage: python tests/checks/offline.py FOLDER
"""

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {"script": "src", "link": "href", "img": "src", "iframe": "src", "source": "src", "embed": "src"}
"""Elements that a browser fetches something for, with the attribute that names it."""
STYLE = re.compile(r"""(?:url\(|@import)\s*["']?((?:https?:)?//[^"')\s;]+)""")


class _Loads(HTMLParser):
    """The addresses that a page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        address = dict(attrs).get(LOADED.get(tag, ""))
        if address and not (tag == "link" and "canonical" in (dict(attrs).get("rel") or "")):
            self.found.append(address)


def findings(folder: Path) -> Iterator[str]:
    """Yield a line for each address of a page or a style sheet that is elsewhere or missing."""
    pages = (path for path in folder.rglob("*.html") if "_static" not in path.relative_to(folder).parts)
    for path in sorted((*pages, *folder.rglob("*.css"))):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(folder).as_posix()
        yield from (f"{name}: loads {address}" for address in STYLE.findall(text))
        if path.suffix == ".html":
            parser = _Loads()
            parser.feed(text)
            for address in parser.found:
                parts = urlsplit(address)
                if parts.scheme == "data":
                    continue
                if parts.scheme or parts.netloc:
                    yield f"{name}: loads {address}"
                elif parts.path and not (path.parent / unquote(parts.path)).exists():
                    yield f"{name}: loads {address}, which is not there"


if __name__ == "__main__":
    lines = list(findings(Path(sys.argv[1])))
    print("\n".join(lines), end="\n" if lines else "")
    sys.exit(bool(lines))
