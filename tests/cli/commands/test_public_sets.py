"""Unit: ``sigdb public-sets`` shows what pages state, and checks a folder."""

import json

import pytest


def test_list_and_cards(leave):
    code, out, _ = leave("public-sets")
    assert code == 0
    assert len(out.splitlines()) == 11
    code, out, _ = leave("public-sets", "seu", "spectraquest")
    assert code == 0
    assert "licence  no page could be cited" in out
    assert "give     --teeth: no cited page states it" in out
    assert "was not tried on real files" in out
    assert "tried on six recordings" in out
    code, out, _ = leave("public-sets", "phm2009", "--format", "json")
    assert json.loads(out)["phm2009"]["settings"]["reading"]["pulses_per_rev"] == 10


def test_a_folder_is_checked(leave, tmp_path):
    (tmp_path / "h30hz0.csv").write_text("a1\n0", encoding="utf-8")
    code, out, err = leave("public-sets", "spectraquest", "--folder", tmp_path)
    assert code == 1
    assert "missing: 19 of 20 files" in out
    assert "changed: h30hz0.csv is not the published file" in out
    assert err == ""
    code, out, err = leave("public-sets", "cwru", "--folder", tmp_path, "--format", "json")
    assert (code, json.loads(out)["unknown"]) == (0, ["h30hz0.csv"])
    assert "sigdb: this adapter of CWRU bearing data, a set without gear damage was not tried on real files" in err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["spectra"], "did you mean 'spectraquest'?"),
        (["--folder", "."], "--folder is of one set, and 0 are named"),
        (["seu", "--out", "db"], "--out and --results need --folder"),
        (["seu", "--folder", ".", "--results", "r.json"], "--results needs --out"),
        (["seu", "--folder", ".", "--out", "db"], "holds no recording of SEU"),
    ],
)
def test_mistakes_are_one_line(leave, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    code, _, err = leave("public-sets", *words)
    assert code == 2
    assert says in err.splitlines()[-1]
