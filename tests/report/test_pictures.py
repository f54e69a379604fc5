"""Unit: pictures of rows of a database."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.pipeline import draw_signature, load_recipe, pictures
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
specimens = 1
healthy = 1

[[sweep.grid]]
tooth = [3]
stiffness_loss = [0.5]

[[sweep.grid]]
tooth = [12]
damaged_teeth = 3
phase_shift_deg = 1.5

[[sweep.grid]]
tooth = [11]
pattern = "pitted-broken"

[[sweep.grid]]
tooth = [5]
stiffness_loss = [0.5]
index_error = [2e-4]

[sweep.patterns]
pitted-broken = [{ stiffness_loss = 0.2 }, { stiffness_loss = 0.5 }]

[measurement]
snr_db = 20.0

[report]
mesh_orders = 3.0
dots_per_inch = 50
"""


# Ids: 0 healthy, 1 healthy with the last grid's index errors, then the grids; with such errors the mesh loses contact.
@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


@pytest.fixture
def asked(monkeypatch):
    """What the picture was asked for, by name."""
    seen = {}
    original = pictures.signature_figure

    def spy(tsa, **options):
        seen.update(options, tsa=tsa)
        return original(tsa, **options)

    monkeypatch.setattr(pictures, "signature_figure", spy)
    return seen


@pytest.mark.parametrize(
    ("id", "damaged", "words"),
    [
        (0, (), "Row 0: undamaged pinion; 102 averages at 20 dB, specimen 0"),
        (2, (3,), "Row 2: pinion tooth 3, 1 damaged, loss 0.5, shift 0 deg; 102 averages"),
        (3, (12, 1, 2), "Row 3: pinion tooth 12, 3 damaged, loss 0, shift 1.5 deg"),
        (4, (11, 12), "Row 4: pinion tooth 11, 2 damaged, pattern pitted-broken"),
    ],
    ids=["healthy", "one", "wrap", "pattern"],
)
def test_a_row_is_drawn_with_its_damage(database, asked, tmp_path, id, damaged, words):
    path = draw_signature(database, id, tmp_path / "row.png")
    assert path == tmp_path / "row.png"
    assert path.read_bytes().startswith(b"\x89PNG")
    assert asked["damaged"] == damaged
    assert asked["title"].startswith(words)
    assert (asked["teeth"], asked["sensor"]) == (12, "pinion-vertical")
    np.testing.assert_array_equal(asked["tsa"], database.signals([id])["tsa"][0])


def test_the_look_is_that_of_the_recipe(database, asked, tmp_path):
    draw_signature(database, 2, tmp_path / "row.png")
    assert (asked["settings"].mesh_orders, asked["settings"].dots_per_inch) == (3.0, 50)


def test_another_sensor_is_drawn_in_its_unit(database, asked, tmp_path):
    draw_signature(database, 2, str(tmp_path / "row.svg"), sensor="pinion-housing-vertical")
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    assert asked["unit"] == rig.sensors["pinion-housing-vertical"].unit
    assert asked["sensor"] == "pinion-housing-vertical"
    np.testing.assert_array_equal(asked["tsa"], database.signals([2], sensor="pinion-housing-vertical")["tsa"][0])
    assert b"<svg" in (tmp_path / "row.svg").read_bytes()


def test_a_row_without_a_result_says_why(database, tmp_path):
    (status,) = database.cases("id = 5")["status"]
    assert status != "ok"
    with pytest.raises(InputError, match=r"row 5 of .* has no signal: .*contact") as caught:
        draw_signature(database, 5, tmp_path / "row.png")
    assert str(caught.value).endswith(status)
    assert not (tmp_path / "row.png").exists()


@pytest.mark.parametrize("id", [-1, 6, 10**9])
def test_an_unknown_row_is_refused(database, tmp_path, id):
    with pytest.raises(InputError, match=rf"id {id} is not in .*, which has 6 finished rows"):
        draw_signature(database, id, tmp_path / "row.png")


def test_an_unknown_sensor_is_refused(database, tmp_path):
    with pytest.raises(InputError, match=r"sensor 'wheel' is not stored in .*; stored: pinion-vertical"):
        draw_signature(database, 0, tmp_path / "row.png", sensor="wheel")


def test_another_format_is_refused(database, tmp_path):
    with pytest.raises(InputError, match="not a picture's name"):
        draw_signature(database, 0, tmp_path / "row.txt")


def test_pictures_that_are_compared_have_one_scale(database, tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(pictures, "save_figure", lambda figure, path, settings: figures.append(figure))
    for id, others in ((0, [2]), (2, [0]), (2, [])):
        draw_signature(database, id, tmp_path / "row.png", others=others)
    healthy, damaged, _ = ([axes.get_ylim() for axes in figure.axes[:2]] for figure in figures)
    colours = [figure.axes[2].images[0].get_clim() for figure in figures]
    assert np.allclose(healthy, damaged)
    assert colours[0] == pytest.approx(colours[1])
    assert colours[2][1] <= colours[1][1]
    for figure in figures[:2]:
        signal = figure.axes[0].lines[0].get_ydata()
        assert healthy[0][0] < signal.min() <= signal.max() < healthy[0][1]
