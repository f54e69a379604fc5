"""What pages share: one file without scripts that needs no network, its style, tables and pictures in it."""

import base64
import html
import io
from collections.abc import Iterable, Sequence

import matplotlib
from matplotlib.figure import Figure


def page(title: str, body: str, *, footer: str) -> str:
    """A whole page.

    Parameters
    ----------
    title
        Heading, as text.
    body, footer
        HTML.
    """
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n{body}\n<footer>{footer}</footer>\n</body>\n</html>\n"
    )


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts, which scrolls where it is too wide."""
    lines = [f"<tr>{''.join(f'<td>{html.escape(one)}</td>' for one in row)}</tr>" for row in rows]
    heads = "".join(f"<th>{html.escape(one)}</th>" for one in head)
    return f'<div class="wide"><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>{"".join(lines)}</tbody></table></div>'


def picture(heading: str, caption: str, figure: Figure) -> str:
    """A figure with heading and caption."""
    return (
        f"<figure>\n<h3>{html.escape(heading)}</h3>\n"
        f'<img alt="{html.escape(f"{heading}. {caption}")}" src="{embedded(figure)}">\n'
        f"<figcaption>{html.escape(caption)}</figcaption>\n</figure>"
    )


def embedded(figure: Figure) -> str:
    """A figure as an SVG in a data address."""
    content = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "sigdb"}):  # the same page each time
        figure.savefig(content, format="svg", dpi=200, metadata={"Date": None, "Creator": None})
    return f"data:image/svg+xml;base64,{base64.b64encode(content.getvalue()).decode()}"


STYLE = """
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
