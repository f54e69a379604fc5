"""Unit: each statement on a public set cites a page, and an adapter that was not tried says so."""

import numpy as np
import pytest

from sigdb.core import InputError, read_toml
from sigdb.public_sets import load_public_set, public_set_names
from sigdb.public_sets.public_set import PublicSet

NAMES = {
    *("spectraquest", "seu", "mcc5-thu", "hums2023", "phm2009", "phm2023", "uconn", "gear0", "qinyi", "mfpt", "cwru"),
}


def test_the_sets():
    assert set(public_set_names()) == NAMES
    with pytest.raises(InputError, match=r"'spectra' is no public set; did you mean 'spectraquest'\?"):
        load_public_set("spectra")


@pytest.mark.parametrize("name", sorted(NAMES))
def test_every_set_is_described_with_its_sources(name):
    described = load_public_set(name)
    statements = [described.where, described.licence, described.gears, described.labels, described.answer]
    used = {each.source for each in (*statements, *described.files) if each is not None}
    assert used == set(described.sources)
    for source in described.sources.values():
        assert source.url.startswith(("https://", "docs/"))
    assert described.licence is not None or any("licence" in text.lower() for text in described.not_cited)
    assert (described.warning == "") == bool(described.tried)
    assert "was not tried on real files" in described.warning or described.tried


def test_the_tooth_counts_that_a_quotient_gives():
    """The script of Gear0 states mesh and shaft frequency; their quotient is the tooth count."""
    assert float(load_public_set("gear0").settings["teeth"]) == pytest.approx(766.666667 / 33.333333, abs=1e-4)
    rates = load_public_set("phm2009").settings["reading"]["sampling_rate"]
    np.testing.assert_allclose(rates, 200e3 / 3, atol=0.01)


@pytest.fixture
def content(tmp_path):
    path = tmp_path / "set.toml"
    path.write_text(
        """
        title = "T"
        expected = "by label"
        label_trust = "seeded"
        where = { text = "W", source = "page" }
        labels = { text = "L", source = "page" }
        answer = { text = "A", source = "page" }
        files = [{ pattern = "{state}.csv", source = "page" }]
        states = { Broken = { health = "damaged", kind = "breakage" }, ok = { health = "healthy", kind = "none" } }
        needs = ["teeth", "sampling_rate"]
        sources = { page = { title = "P", url = "https://example.org" } }
        """,
        encoding="utf-8",
    )
    return read_toml(path)


def test_a_statement_without_a_source_is_refused(content):
    assert PublicSet(**content).title == "T"
    content["labels"] = {"text": "L", "source": "pgae"}
    with pytest.raises(InputError, match=r"source 'pgae' is not among the sources; did you mean 'page'\?"):
        PublicSet(**content)


def test_right_answers(content):
    described = PublicSet(**content)
    assert [described.expected_of(word) for word in ("broken", "OK", "else", None)] == [
        *("damage", "none", "unknown", "unknown")
    ]
    whatever = PublicSet(**content | {"expected": "none"})
    assert [whatever.expected_of(word) for word in ("broken", None)] == ["none", "none"]


def test_settings_that_no_page_states_must_be_given(content):
    described = PublicSet(**content)
    with pytest.raises(InputError, match="no cited page states teeth, sampling_rate; give --teeth and --sampling-rate"):
        described.ingest_settings()
    settings = described.ingest_settings({"teeth": "32/80", "reading": {"sampling_rate": 1e4}})
    assert (settings.teeth, settings.reading.sampling_rate) == ("32/80", 1e4)
    stated = PublicSet(**content | {"needs": [], "settings": {"teeth": "3", "reading": {"sampling_rate": 5.0}}})
    assert stated.ingest_settings({"reading": {"tacho": "t"}}).reading.sampling_rate == 5
