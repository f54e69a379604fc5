"""What pages share: one file without scripts that needs no network, its style, tables and pictures in it."""

import base64
import html
import io
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import matplotlib
from matplotlib.figure import Figure


def page(title: str, body: str, *, footer: str, style: str = "") -> str:
    """A whole page.

    Parameters
    ----------
    title
        Heading, as text.
    body, footer
        HTML.
    style
        CSS, where a page differs from the others.
    """
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}{style}</style>\n</head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n{body}\n<footer>{footer}</footer>\n</body>\n</html>\n"
    )


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts, which scrolls where it is too wide; without a head where no column has a name."""
    heads = f"<thead>{_row('th', head)}</thead>\n" if any(head) else ""
    lines = "\n".join(_row("td", row) for row in rows)
    return f'<div class="wide"><table>\n{heads}<tbody>{lines}</tbody></table></div>'


def _row(tag: str, texts: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(one)}</{tag}>" for one in texts) + "</tr>"


def svg(figure: Figure) -> str:
    """A figure as an SVG in a data address."""
    with matplotlib.rc_context({"svg.hashsalt": "sigdb"}):  # the same page each time
        return _address("svg+xml", figure, format="svg", dpi=200, metadata={"Date": None, "Creator": None})


def png(figure: Figure) -> str:
    """A figure as a PNG in a data address: an SVG of tens of thousands of points would be large."""
    return _address("png", figure, format="png", dpi=150, metadata={"Software": None})


def _address(kind: str, figure: Figure, **options: Any) -> str:
    content = io.BytesIO()
    figure.savefig(content, **options)
    return f"data:image/{kind};base64,{base64.b64encode(content.getvalue()).decode()}"


def picture(heading: str, caption: str, figure: Figure, *, embedded: Callable[[Figure], str] = svg) -> str:
    """A figure with heading and caption, by one of the two above."""
    return (
        f"<figure>\n<h3>{html.escape(heading)}</h3>\n"
        f'<img alt="{html.escape(f"{heading}. {caption}")}" src="{embedded(figure)}">\n'
        f"<figcaption>{html.escape(caption)}</figcaption>\n</figure>"
    )


_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b2430; background: #fff; margin: 0 auto; padding: 1rem;
  max-width: 66rem; }
h1 { font-size: 1.5rem; line-height: 1.25; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin-top: 1.8rem; }
h3 { font-size: 1rem; margin: 0 0 .4rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid #e3e6ea; white-space: nowrap;
  vertical-align: top; }
.ours { font-weight: 600; }
.ends { color: #667080; font-weight: 400; font-size: .8rem; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 28rem), 1fr)); gap: 2rem;
  margin-top: 2rem; }
figure { margin: 0; break-inside: avoid; }
figure img { width: 100%; max-width: 36rem; height: auto; }
figcaption { color: #4a5565; font-size: .88rem; }
footer { color: #667080; font-size: .85rem; margin-top: 2rem; }
.alarm { border-left: .3rem solid #c8553d; background: #fbeeea; padding: .6rem .8rem; }
@media (max-width: 40rem) { td:first-child { white-space: normal; min-width: 8rem; } }
@media print { body { font-size: 10pt; max-width: none; padding: 0; } .wide { overflow: visible; }
  table { font-size: 7.5pt; } .pictures { display: block; } figure { margin-bottom: 1rem; }
  figure img { width: 62%; } }
"""
