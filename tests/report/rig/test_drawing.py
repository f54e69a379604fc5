"""Unit: the drawing of a rig, its Campbell diagram, and its page of text."""

from functools import cache
from math import pi

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.pipeline import draw_rig
from sigdb.report import campbell_figure, rig_figure, rig_text
from sigdb.report.rig.layout import lay_out
from sigdb.transmission import Transmission, built_in_transmissions, coupled_modes, describe_rig

SMALL = ("friswell-5.9.1", "luo-10dof")


def rig(name):
    return sigdb.load_transmission(name)


@cache
def drawing(name):
    return rig_figure(rig(name))


def words(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def spread(texts):
    """Pairs of texts of a drawing whose boxes overlap by more than a line's margin."""
    figure = texts[0].figure
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts if text.get_text()]
    for i, (a, box) in enumerate(boxes):
        for b, other in boxes[i + 1 :]:
            wide = min(box.x1, other.x1) - max(box.x0, other.x0)
            high = min(box.y1, other.y1) - max(box.y0, other.y0)
            if wide > 1 and high > 3:
                yield a, b


@pytest.mark.parametrize("name", built_in_transmissions())
def test_a_drawing_names_every_part_and_no_word_hides_another(name):
    one, figure = rig(name), drawing(name)
    told = "\n".join(words(figure))
    sensors = [key for key, sensor in one.sensors.items() if sensor.gear]
    for part in (*one.shafts, *one.gears, *one.disks, *one.bearings, *one.meshes, *one.couplings, *sensors):
        assert part in told
    assert list(spread(figure.axes[0].texts)) == []


@pytest.mark.parametrize("name", built_in_transmissions())
def test_every_word_of_a_drawing_is_inside_it(name):
    figure = drawing(name)
    figure.canvas.draw()
    for text in figure.axes[0].texts:
        box = text.get_window_extent(figure.canvas.get_renderer())
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0
        assert box.y1 <= figure.bbox.y1


@pytest.mark.parametrize("name", ["spur-test-rig", "two-stage-gearbox", "friswell-turbogenerator"])
def test_gears_in_mesh_are_in_line(name):
    one, at = rig(name), lay_out(rig(name))
    for mesh in one.meshes.values():
        a, b = (one.gears[gear] for gear in (mesh.driving, mesh.driven))
        assert at.x(a.shaft, a.node) == pytest.approx(at.x(b.shaft, b.node), abs=1e-9)


def test_a_drawing_is_to_scale():
    one, at = rig("friswell-turbogenerator"), lay_out(rig("friswell-turbogenerator"))
    np.testing.assert_allclose(at.nodes["generator-shaft"], [0, 0.1, 4.34, 5.5, 5.8], atol=1e-12)
    np.testing.assert_allclose(np.diff(at.nodes["turbine-shaft"]), [0.3, 5.0, 0.1], atol=1e-12)
    radii = {body.name: (body.radius, body.exact) for body in at.bodies}
    assert radii["wheel"] == (pytest.approx(one.geometries["main"].radii[0]), True)
    assert radii["turbine"] == (pytest.approx(np.sqrt(2 * 0.149 / 7.45)), False)
    assert radii["generator"] == (pytest.approx(np.sqrt(2 * 32.2 / 525.7)), False)


def test_whirl_splits_in_the_campbell_diagram():
    one = rig("friswell-5.9.1")
    figure = campbell_figure(one)
    (marks,) = figure.axes[0].collections
    x, y = marks.get_offsets().T
    assert len(np.unique(x)) == 25
    assert x.max() == pytest.approx(5000)
    second = [np.sort(y[x == speed])[2:4] for speed in np.unique(x)]
    gaps = np.diff(second, axis=1)[:, 0]
    assert np.all(np.diff(gaps) > 0)  # the pair drifts apart with speed
    assert gaps[0] < 0.5
    # Published at 4000 rpm, between two of the speeds shown: 251.78 and 294.71 rad/s.
    at_4000 = [np.interp(4000, np.unique(x), np.array(second)[:, i]) * 2 * pi for i in (0, 1)]
    np.testing.assert_allclose(at_4000, [251.78, 294.71], rtol=1e-3)


def test_the_campbell_diagram_has_the_orders_of_shafts_and_meshes():
    one = rig("luo-10dof")
    figure = campbell_figure(one)
    shafts, meshes = figure.axes[:2]
    for axes, frequencies in ((shafts, [25.0, 25 / 3]), (meshes, [400.0, 800.0, 1200.0])):
        slopes = {round(line.get_ydata()[1] / line.get_xdata()[1] * 1500, 6) for line in axes.lines[: len(frequencies)]}
        assert slopes == {round(one, 6) for one in frequencies}
        assert axes.lines[len(frequencies)].get_xdata()[0] == 1500
    assert meshes.get_ylim()[1] == pytest.approx(1.1 * 1200)
    assert campbell_figure(one, max_hz=500.0).axes[0].get_ylim()[1] == 500
    told = [text.get_text() for text in meshes.texts]
    assert {"main 1x", "main 2x", "main 3x", "operating"} <= set(told)
    assert set(shafts.get_xlim()) == {0.0, 1875.0}


def test_a_rig_that_stands_still_has_no_campbell_diagram(tmp_path):
    still = rig("friswell-5.9.1").replace({"operating.speed_rpm": 0.0})
    with pytest.raises(InputError, match=r"stands still; .* operating.speed_rpm above 0"):
        campbell_figure(still)
    assert draw_rig(still, tmp_path) == [tmp_path / "rig.png"]


def test_pictures_are_written(tmp_path):
    assert draw_rig(rig("luo-10dof"), tmp_path / "new") == [
        tmp_path / "new" / name for name in ("rig.png", "campbell.png")
    ]
    for name in ("rig.png", "campbell.png"):
        assert (tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", built_in_transmissions())
def test_every_built_in_rig_is_described(name):
    one = rig(name)
    facts = describe_rig(one)
    text = rig_text(facts)
    assert text.startswith(f"{name}: {one.title}\n")
    for table in ("shafts", "gears", "disks", "meshes", "bearings", "couplings", "sensors"):
        assert [row["name"] for row in facts[table]] == list(getattr(one, table))
    assert facts["origins"]["unstated"] == 0
    assert " nan" not in text
    assert "-0.0000" not in text
    frequencies = [mode["frequency_hz"] for mode in facts["modes"]]
    assert frequencies == sorted(frequencies)
    found = coupled_modes(one).frequency_hz
    assert facts["overdamped"] == np.sum(found == 0)
    top = 3 * max((one.mesh_frequency(mesh) for mesh in one.meshes), default=0.0)
    if top:
        assert len(frequencies) == max(np.sum((found > 0) & (found <= top)), min(6, np.sum(found > 0)))


def test_resonances_are_those_within_five_percent():
    facts = describe_rig(rig("nasa-spiral-bevel"))
    exciting = {"shaft pinion-shaft": 240.0, "shaft gear-shaft": 80.0, "mesh main": 2880.0}
    found = {(round(one["frequency_hz"], 6), one["excited_by"], one["order"]) for one in facts["resonances"]}
    wanted = {
        (round(mode["frequency_hz"], 6), what, order)
        for mode in facts["modes"]
        for what, hertz in exciting.items()
        for order in ((1, 2, 3) if what == "mesh main" else (1,))
        if abs(mode["frequency_hz"] - order * hertz) <= 0.05 * order * hertz
    }
    assert found == wanted != set()


def test_a_mode_without_a_peak_is_no_resonance():
    facts = describe_rig(rig("luo-10dof").replace({"operating.speed_rpm": 1380.0}))
    assert any(abs(mode["frequency_hz"] / 368 - 1) < 0.05 and mode["damping_ratio"] > 0.9 for mode in facts["modes"])
    assert all(one["damping_ratio"] < 0.7 for one in facts["resonances"])


def test_excitations_are_listed():
    one = rig("spur-test-rig").replace(
        {"pinion.unbalance": 1e-5, "wheel.runout": 5e-6, "operating.load_fluctuation": 0.1, "operating.load_order": 2}
    )
    whats = {row["what"]: (row["size"], row["unit"], row["shaft"]) for row in describe_rig(one)["excitations"]}
    assert whats == {
        "unbalance of pinion": (1e-5, "kg m", "pinion-shaft"),
        "run-out of wheel": (5e-6, "m", "wheel-shaft"),
        "fluctuation of the load, order 2": (0.1, "of the mean", "wheel-shaft"),
    }
    assert "run-out of wheel" in rig_text(describe_rig(one))


@pytest.mark.parametrize("name", SMALL)
def test_a_number_without_a_source_is_counted(name):
    one = rig(name)
    key = next(iter(one.bearings))
    data = one.model_dump()
    data["bearings"][key]["sources"].pop("stiffness")
    assert describe_rig(Transmission(**data))["origins"]["unstated"] == 1
