"""The tables of models between the points of their training, in the page of models: they are the stored ones."""

import importlib

import pytest


@pytest.fixture(scope="module")
def made():
    return importlib.import_module("between_points")


def test_the_page_of_models_holds_the_stored_tables(made):
    page = made.PAGE.read_text(encoding="utf-8")
    assert made.BEGIN in page
    assert page == made.with_tables(page, made.stored_tables())


def test_no_band_of_the_shipped_location_model_loses_more_than_a_quarter_of_a_decibel(made):
    losses = [row["loss, dB"] for rows in made.stored_tables().values() for row in rows if "loss, dB" in row]
    assert len(losses) == 11
    assert max(losses) <= 0.25
