"""Unit: the picture of a signature shows what it says, at the right place and height."""

import matplotlib
import numpy as np
import pytest
from matplotlib.patches import Rectangle
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.report import ReportSettings, save_figure, signature_figure


def tones(teeth, *, samples_per_tooth=34, amplitudes):
    """A sum of cosines of the angle: amplitude by order."""
    angle = 2 * np.pi * np.arange(teeth * samples_per_tooth) / (teeth * samples_per_tooth)
    return sum(a * np.cos(order * angle + order) for order, a in amplitudes.items())


def drawn(tsa=None, *, teeth=12, damaged=(), settings=None):
    tsa = tones(teeth, amplitudes={teeth: 1.0}) if tsa is None else tsa
    return signature_figure(
        tsa, teeth=teeth, sensor="pinion-vertical", unit="m/s^2", title="Row 7", damaged=damaged, settings=settings
    )


def marked(axes):
    """Angles over which a panel shows damage, in order of drawing."""
    return [(one.get_x(), one.get_x() + one.get_width()) for one in axes.patches if isinstance(one, Rectangle)]


def numbers(axes):
    return {int(text.get_text()): (text.xy[0], text.get_color()) for text in axes.texts}


def test_three_panels_say_what_they_show_and_in_which_unit():
    figure = drawn()
    signal, spectrum, distribution = figure.axes[:3]
    assert figure.get_suptitle() == "Row 7"
    titles = [axes.get_title(loc="left") for axes in (signal, spectrum, distribution)]
    assert titles[0] == "Synchronous average"
    assert titles[1] == "Order spectrum (peak amplitude)"
    assert titles[2].startswith("Wigner-Ville distribution")
    assert signal.get_ylabel() == "pinion-vertical, m/s^2"
    assert spectrum.get_ylabel() == "m/s^2"
    assert spectrum.get_xlabel().startswith("order, 1/rev")
    assert distribution.get_ylabel() == "order, 1/rev"
    assert distribution.get_xlabel().startswith("angle, deg")
    assert figure.axes[3].get_ylabel() == "(m/s^2)$^2$ per bin"


def test_the_signal_is_drawn_against_angle_and_closes():
    tsa = tones(12, amplitudes={12: 2.0, 1: 0.5})
    angle, value = drawn(tsa).axes[0].lines[0].get_data()
    assert_allclose(angle[[0, 1, -1]], [0, 360 / len(tsa), 360])
    assert_allclose(value, np.append(tsa, tsa[0]))
    assert drawn(tsa).axes[0].get_xlim() == (0, 360)


@pytest.mark.parametrize("teeth", [12, 36])
def test_spectrum_heights_are_the_amplitudes_of_the_tones(teeth):
    amplitudes = {1: 0.25, teeth: 2.0, teeth + 1: 0.5, 2 * teeth: 1.0}
    tsa = 9.0 + tones(teeth, amplitudes=amplitudes)
    axes = drawn(tsa, teeth=teeth).axes[1]
    (lines,) = axes.collections
    found = {round(segment[1][0]): segment[1][1] for segment in lines.get_segments()}
    assert min(found) == 1  # the mean, order 0, is not shown
    assert max(found) == 4 * teeth
    assert_allclose([found.pop(order) for order in amplitudes], list(amplitudes.values()), rtol=1e-9)
    assert max(found.values()) < 1e-9
    assert all(segment[0][1] == 0 for segment in lines.get_segments())
    assert axes.get_xlim() == (0, 4 * teeth)
    assert axes.get_ylim()[0] == 0
    assert axes.get_ylim()[1] >= 2.0
    assert_allclose(axes.get_xticks(), teeth * np.arange(5))


def test_the_highest_order_is_a_setting_and_at_most_half_the_samples():
    assert drawn(settings=ReportSettings(mesh_orders=2.5)).axes[1].get_xlim() == (0, 30)
    assert drawn(settings=ReportSettings(mesh_orders=100.0)).axes[1].get_xlim() == (0, 12 * 34 / 2)
    assert drawn(settings=ReportSettings(mesh_orders=2.0)).axes[2].get_ylim() == pytest.approx((0, 24), abs=0.5)


def test_the_distribution_shows_a_tone_at_its_order():
    tsa = tones(12, amplitudes={12: 1.0})
    axes = drawn(tsa).axes[2]
    (image,) = axes.images
    shown = np.asarray(image.get_array())
    left, right, bottom, top = image.get_extent()
    assert (left, right, bottom) == (0, 360, -0.25)  # half a bin below order 0
    assert shown.shape[1] == len(tsa)
    order = bottom + (shown.mean(axis=1).argmax() + 0.5) * (top - bottom) / shown.shape[0]
    assert order == pytest.approx(12, abs=0.5)  # one bin
    assert image.origin == "lower"
    assert image.norm.vmax == -image.norm.vmin


def test_a_burst_is_shown_at_its_angle():
    n = 12 * 34
    angle = np.arange(n) / n * 360
    burst = np.exp(-(((angle - 105) / 8) ** 2)) * np.cos(2 * np.pi * 24 * angle / 360)
    shown = np.asarray(drawn(burst).axes[2].images[0].get_array())
    assert (shown.sum(axis=0).argmax() + 0.5) * 360 / n == pytest.approx(105, abs=2)


@pytest.mark.parametrize(
    ("damaged", "spans"),
    [((), []), ((6,), [(150, 180)]), ((11, 12, 1), [(300, 330), (330, 360), (0, 30)])],
    ids=["none", "one", "over the tacho mark"],
)
def test_damaged_passes_are_marked_over_angle(damaged, spans):
    signal, spectrum, distribution = drawn(damaged=damaged).axes[:3]
    for axes in (signal, distribution):
        assert_allclose(marked(axes), np.reshape(spans, (-1, 2)) if spans else [], atol=1e-9)
        colours = {tooth: colour for tooth, (_, colour) in numbers(axes).items()}
        assert list(colours) == list(range(1, 13))
        assert len({colours[tooth] for tooth in damaged}) <= 1
        plain = {colour for tooth, colour in colours.items() if tooth not in damaged}
        assert not plain & {colours[tooth] for tooth in damaged}
    assert marked(spectrum) == []


def test_passes_are_numbered_in_their_middle_and_parted_by_lines():
    axes = drawn().axes[0]
    assert_allclose([x for x, _ in numbers(axes).values()], 15 + 30 * np.arange(12))
    assert_allclose([line.get_xdata()[0] for line in axes.lines[1:]], 30 * np.arange(12))


def test_of_many_teeth_a_few_are_numbered():
    axes = drawn(teeth=36, damaged=(36, 1)).axes[0]
    assert list(numbers(axes)) == list(range(1, 37, 2))
    assert_allclose([x for x, _ in numbers(axes).values()], 5 + 20 * np.arange(18))
    assert_allclose(marked(axes), [(350, 360), (0, 10)], atol=1e-9)


@pytest.mark.parametrize("value", [0.0, 1e-9])
def test_a_constant_signal_is_drawn(value, tmp_path):
    save_figure(drawn(np.full(12 * 34, value)), tmp_path / "constant.png")
    assert (tmp_path / "constant.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("name", "begins"), [("a.png", b"\x89PNG\r\n"), ("b.SVG", b"<?xml"), ("c.pdf", b"%PDF")], ids=["png", "svg", "pdf"]
)
def test_the_suffix_is_the_format(tmp_path, name, begins):
    path = tmp_path / "made" / "here" / name
    save_figure(drawn(), path)
    assert path.read_bytes().startswith(begins)


def test_the_resolution_is_a_setting(tmp_path):
    sizes = []
    for dots in (50, 100):
        save_figure(drawn(), tmp_path / "a.png", ReportSettings(dots_per_inch=dots))
        header = (tmp_path / "a.png").read_bytes()[16:24]
        sizes.append((int.from_bytes(header[:4], "big"), int.from_bytes(header[4:], "big")))
    assert sizes == [(400, 430), (800, 860)]


@pytest.mark.parametrize("name", ["a.txt", "a", "a.png.gz"])
def test_another_suffix_is_refused_before_anything_is_made(tmp_path, name):
    with pytest.raises(InputError, match=r"not a picture's name; end it in \.png, \.svg or \.pdf"):
        save_figure(drawn(), tmp_path / "made" / name)
    assert list(tmp_path.iterdir()) == []


def test_drawing_leaves_the_settings_of_matplotlib_and_opens_no_window():
    before = dict(matplotlib.rcParams)
    drawn()
    assert dict(matplotlib.rcParams) == before
    assert type(drawn().canvas).__name__ == "FigureCanvasAgg"
