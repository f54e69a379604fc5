"""Unit: pages escape every text, know every name that their templates use, and draw the same picture each time."""

import base64
import re
from importlib.resources import files

import pytest
from jinja2 import UndefinedError
from matplotlib.figure import Figure

from sigdb.report.page import CaptionedFigure, Cell, environment, page, png, svg

SCRIPT = "<script>alert('&\"')</script>"
TEMPLATES = sorted(path.name for path in (files("sigdb.report") / "templates").iterdir())


def drawn():
    figure = Figure()
    figure.subplots().plot([0, 1])
    return figure


def shared(call, **values):
    """What a part of the shared templates makes of values."""
    source = f'{{% from "parts.html" import picture, sentences, table %}}{{{{ {call} }}}}'
    return environment().from_string(source).render(**values)


def test_titles_are_escaped_in_the_frame():
    text = page("base.html", title=SCRIPT)
    assert "<script" not in text
    assert text.count("&lt;script&gt;alert(&#39;&amp;&#34;&#39;)&lt;/script&gt;") == 2
    assert not re.findall(r"<link|https?://|url\(", text)


@pytest.mark.parametrize(
    "call",
    [
        "table([x], [[x]], ours=0)",
        "table([cell], [[cell]])",
        "sentences(x, [x])",
        "picture(captioned)",
        "picture(captioned, 'png')",
    ],
)
def test_shared_parts_escape_every_text(call):
    text = shared(call, x=SCRIPT, cell=Cell(SCRIPT, SCRIPT), captioned=CaptionedFigure(SCRIPT, SCRIPT, drawn()))
    assert "<script" not in text
    assert text.count("&lt;script&gt;") >= 2


def test_a_table_without_a_head_and_a_list_without_sentences_have_no_heading():
    assert "<thead>" not in shared("table([], [['a']])")
    assert shared("sentences('Notes', [])") == ""
    assert '<td>1 <span class="ends">[0, 2]</span></td>' in shared("table([], [[cell]])", cell=Cell("1", "[0, 2]"))


def test_a_name_that_the_page_lacks_is_an_error():
    with pytest.raises(UndefinedError, match="'answer' is undefined"):
        page("diagnosis.html", title="t", alarm=False)


@pytest.mark.parametrize("name", TEMPLATES)
def test_no_template_leaves_text_unescaped(name):
    source = (files("sigdb.report") / "templates" / name).read_text(encoding="utf-8")
    assert not re.findall(r"\bsafe\b|autoescape|<script|\son\w+=", source)
    environment().get_template(name)


def test_pictures_are_the_same_each_time():
    for embed, begin in ((svg, b"<?xml"), (png, b"\x89PNG")):
        address = embed(drawn())
        assert address == embed(drawn())
        assert base64.b64decode(address.split(",")[1]).startswith(begin)
