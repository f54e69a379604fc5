"""The picture of a view is that of the library's own simulation."""

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError, specimen_stream
from sigdb.explorer import View
from sigdb.explorer.code import python_code, recipe_code
from sigdb.measurement import index_errors
from sigdb.pipeline import load_recipe
from sigdb.signature import order_spectrum

VIEWS = [
    {},
    {"tooth": 6, "stiffness_loss": 0.4},
    {"tooth": 12, "damaged_teeth": 2, "phase_shift_deg": 3.0, "torque": 200.0},
    {"tooth": 3, "stiffness_loss": 0.2, "speed_rpm": 12000.0, "index_error": 2e-6, "specimen": 3},
    {"tooth": 1, "stiffness_loss": 0.3, "teeth": 13, "torque": 500.0, "sensor": "pinion-housing-vertical"},
]


def simulated(live, settings):
    """The response by the library's own door, at the rig of the settings."""
    changes = {"operating.speed_rpm": settings.get("speed_rpm"), "operating.torque": settings.get("torque"),
               "gears.pinion.teeth": settings.get("teeth")}  # fmt: skip
    rig = live.rig.replace({path: value for path, value in changes.items() if value is not None})
    teeth = rig.gears["pinion"].teeth
    errors = settings.get("index_error", 0) * index_errors(specimen_stream(1, settings.get("specimen", 0)), teeth, 36)
    damage = {name: settings[name] for name in settings if name in sigdb.Damage.model_fields}
    return sigdb.simulate(rig, damage, index_errors=errors)


@pytest.mark.parametrize("settings", VIEWS)
def test_an_average_is_that_of_a_simulation(live, settings):
    shown, response = live.show(View.of(settings)), simulated(live, settings)
    expected = response.signal(settings.get("sensor", "pinion-vertical"))
    np.testing.assert_allclose(shown.arrays["tsa"], expected, atol=1e-9 * np.ptp(expected))
    assert shown.facts["least_force"] == pytest.approx(response.min_mesh_force, rel=1e-6)
    assert shown.facts["least_compression"] == pytest.approx(response.min_compression, rel=1e-6)
    amplitudes = np.abs(order_spectrum(expected)[1])[: 4 * shown.facts["teeth"] + 1]
    np.testing.assert_allclose(shown.arrays["spectrum"], amplitudes, atol=1e-9 * amplitudes.max())


def test_a_healthy_average_stands_behind_a_damaged_one(live):
    healthy, damaged = (live.show(View.of(view)).arrays for view in ({}, VIEWS[1]))
    np.testing.assert_array_equal(damaged["tsa_healthy"], healthy["tsa"])
    assert np.abs(damaged["tsa"] - damaged["tsa_healthy"]).max() > 0.05 * np.ptp(healthy["tsa"])
    lost = damaged["stiffness_healthy"] - damaged["stiffness"]
    assert 5 * 64 <= np.argmax(lost) < 7 * 64
    assert lost.max() == pytest.approx(0.4 * live.rig.meshes["main"].stiffness, rel=0.5)


def test_the_event_walks_with_the_tooth(live):
    """Damage at another tooth is the same signal turned, and so is its distribution."""
    first, fourth = (live.show(View.of({"tooth": tooth, "stiffness_loss": 0.4})).arrays for tooth in (1, 4))
    np.testing.assert_allclose(np.roll(first["tsa"], 3 * 64), fourth["tsa"], atol=1e-6 * np.ptp(first["tsa"]))
    columns = 3 * len(first["wigner_ville"]) // 12
    scale = np.abs(first["wigner_ville"]).max()
    np.testing.assert_allclose(
        np.roll(first["wigner_ville"], columns, axis=0), fourth["wigner_ville"], atol=1e-4 * scale
    )


def test_the_noise_has_the_stated_level(live):
    settings = VIEWS[1] | {"snr_db": -10.0, "averages": 10}
    noisy, clean = (live.show(View.of(view)).arrays["tsa"] for view in (settings, VIEWS[1]))
    healthy = simulated(live, {}).signal("pinion-vertical")
    expected = healthy.std() * 10**0.5 / 10**0.5
    assert (noisy - clean).std() == pytest.approx(expected, rel=4 / np.sqrt(2 * len(clean)))


@pytest.mark.parametrize("settings", [*VIEWS, VIEWS[3] | {"snr_db": 3.0, "averages": 51}])
def test_copied_python_computes_the_average_of_the_page(live, settings):
    view, names = View.of(settings), {}
    exec(python_code(live, view, "nasa-spiral-bevel"), names)
    average = live.show(view).arrays["tsa"]
    np.testing.assert_allclose(names["average"], average, atol=1e-9 * np.ptp(average))


def test_a_copied_recipe_plans_the_case_of_the_page(live, tmp_path):
    text = recipe_code(
        live, View.of(VIEWS[2]), "nasa-spiral-bevel", {"stiffness_loss": [0.1, 0.2], "snr_db": [0.0, 10.0]}
    )
    (tmp_path / "recipe.toml").write_text(text, encoding="utf-8")
    plan = load_recipe(tmp_path / "recipe.toml").plan()
    rows = plan.table_of(np.arange(plan.rows))
    assert len(rows) == 4
    assert set(rows["stiffness_loss"]) == {0.1, 0.2}
    assert set(rows["snr_db"]) == {0.0, 10.0}
    assert rows[["tooth", "damaged_teeth", "phase_shift_deg", "torque"]].drop_duplicates().iloc[0].tolist() == [
        12,
        2,
        3,
        200,
    ]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"tooth": 13, "stiffness_loss": 0.1}, r"tooth 13 does not exist"),
        ({"tooth": 1, "stiffness_loss": 2}, r"stiffness_loss"),
        ({"sensor": "nose"}, r"sensor 'nose' is not in the rig; it has pinion-vertical"),
        ({"colour": "red"}, r"colour"),
        ({"speed_rpm": -1.0}, r"speed_rpm"),
        ({"tooth": 1, "crack_depth": 1e-3}, r"geometry|crack"),
    ],
)
def test_settings_that_break_a_rule_are_refused(live, settings, message):
    with pytest.raises(InputError, match=message):
        live.show(View.of(settings))
