import hashlib
import re
from pathlib import Path

import pytest

import sigdb
import sigdb.explorer
from sigdb.core import InputError
from sigdb.explorer import static_page, write_static

FOLDER = Path(sigdb.explorer.__file__).parent


def test_one_file_holds_all(tmp_path, monkeypatch):
    monkeypatch.setattr(static_page, "_LOSSES", (0.0, 0.4))
    monkeypatch.setattr(static_page, "_SHIFTS", 2)
    path = tmp_path / "page.html"
    write_static(sigdb.load_transmission("nasa-spiral-bevel"), "nasa-spiral-bevel", path)
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=\"(?!data:)", text)
    assert not re.search(r"^(import|export) ", text, flags=re.MULTILINE)
    assert text.count('"stiffness_loss": 0.4') == 4


def test_a_rig_that_does_not_turn_exactly_is_refused(tmp_path):
    rig = sigdb.load_transmission("two-stage-gearbox")
    with pytest.raises(InputError, match="not the same damage turned"):
        write_static(rig, rig.name, tmp_path / "page.html", gear="middle-pinion")


def test_the_explorer_stays_small():
    own = [
        file
        for file in FOLDER.rglob("*")
        if file.suffix in {".py", ".pyi", ".js", ".css", ".html"} and file.parent.name != "vendor"
    ]
    assert sum(len(file.read_text(encoding="utf-8").splitlines()) for file in own) <= 3000
    assert sum(file.stat().st_size for file in (FOLDER / "static").rglob("*") if file.is_file()) <= 200_000


def test_the_vendored_library_is_the_published_one():
    digest = hashlib.sha256((FOLDER / "static/vendor/uPlot.iife.min.js").read_bytes()).hexdigest()
    assert digest == "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f"
    assert "MIT License" in (FOLDER / "static/vendor/LICENSE-uPlot.txt").read_text(encoding="utf-8")
