"""Unit: each claim of the paper finds what was put into a synthetic signal, and nothing where nothing was put."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.paper import claim_results as results
from sigdb.paper import measures
from sigdb.paper.claims import CLAIMS
from sigdb.paper.signals import PaperSignals

TEETH, N = 12, 768
THETA = 2 * np.pi * np.arange(N) / N
ANGLE = np.rad2deg(THETA)
MESH = np.cos(TEETH * THETA + 0.3)


def bump(centre, width=20.0):
    """A Gaussian about an angle, deg."""
    away = (ANGLE - centre + 180) % 360 - 180
    return np.exp(-0.5 * (away / width) ** 2)


def in_passes(*passes):
    """One in some tooth passes, zero elsewhere."""
    return np.isin(np.arange(N) // (N // TEETH) + 1, passes).astype(float)


def signals(**changed):
    """All cases as the healthy one, but for those that are given."""
    same = dict.fromkeys((1.5, 3.0, 4.5), MESH)
    plain = PaperSignals(
        teeth=TEETH,
        healthy=MESH,
        shifts=same,
        elsewhere=MESH,
        losses=dict.fromkeys((0.25, 0.5), MESH),
        pitted=MESH,
        broken=MESH,
        min_compression=0.5,
    )
    return replace(plain, **changed)


def modulated(centre, amplitudes, phases_deg, width=20.0):
    at = bump(centre, width)
    return {
        shift: (1 + a * at) * np.cos(TEETH * THETA + np.deg2rad(b) * at)
        for shift, a, b in zip((1.5, 3.0, 4.5), amplitudes, phases_deg, strict=True)
    }


def test_p1_reads_the_modulation_of_pass_six():
    found = results.modulation_rises(signals(shifts=modulated(165, (0.1, 0.2, 0.3), (5, 10, 15), 30)))
    assert found.holds is True
    # Relative to the mean amplitude; a Gaussian of 30 deg lies in the band of 5 orders but for a per cent.
    at = bump(165, 30)
    assert found.value == pytest.approx(0.3 * (1 - np.median(at)) / (1 + 0.3 * at.mean()), rel=0.02)
    assert found.numbers["phase, 4.5 deg [deg]"] == pytest.approx(15 * (1 - np.median(at)), rel=0.03)
    assert found.numbers["highest amplitude in pass 6, 4.5 deg"] == found.value


@pytest.mark.parametrize(
    ("centre", "amplitudes", "phases"),
    [
        (165, (0.1, 0.3, 0.2), (5, 10, 15)),
        (165, (0.1, 0.2, 0.3), (-5, -10, -15)),
        (165, (-0.1, -0.2, -0.3), (5, 10, 15)),
        (165, (0.01, 0.02, 0.03), (5, 10, 15)),
        (285, (0.1, 0.2, 0.3), (5, 10, 15)),
    ],
    ids=["not growing", "phase falls", "amplitude falls", "too small", "at pass 10"],
)
def test_p1_does_not_hold_for_another_modulation(centre, amplitudes, phases):
    assert results.modulation_rises(signals(shifts=modulated(centre, amplitudes, phases))).holds is False


def sideband_case(sizes, other):
    shifts = {
        q: MESH + a * (np.cos(11 * THETA) + np.cos(13 * THETA + 1)) for q, a in zip((1.5, 3, 4.5), sizes, strict=True)
    }
    return signals(shifts=shifts, elsewhere=np.roll(shifts[4.5], other))


def test_p2_adds_sidebands_and_turns_the_damage():
    found = results.sidebands_grow(sideband_case((0.1, 0.2, 0.3), 192))
    assert found.holds is True
    sums = [value for name, value in found.numbers.items() if name.startswith("sidebands")]
    assert_allclose(sums, [0, 0.2, 0.4, 0.6], atol=1e-12)
    assert results.sidebands_grow(sideband_case((0.1, 0.3, 0.2), 192)).holds is False
    case = sideband_case((0.1, 0.2, 0.3), 0)
    assert results.sidebands_grow(replace(case, elsewhere=1.1 * case.elsewhere)).holds is False


def low(passes, *orders):
    """The mesh order, and low orders in some passes."""
    window = bump(30 * np.mean(passes) - 15, 25)
    return {4.5: MESH + window * sum(np.cos(o * THETA) for o in orders)} if orders else {4.5: MESH}


@pytest.mark.parametrize(
    ("shifts", "holds"),
    [
        (low((6, 7), 8, 4), True),
        (low((6, 7), 20), False),
        (low((10, 11), 8, 4), False),
        (low((6, 7)), False),
        ({4.5: low((6, 7), 8, 4)[4.5] * (1 - bump(45, 25))}, False),
    ],
    ids=["both", "a high order", "elsewhere", "none", "a gap in the ridge"],
)
def test_p3_finds_orders_eight_and_four(shifts, holds):
    assert results.mesh_order_and_low_orders(signals(shifts=shifts)).holds is holds


def test_p3_finds_order_one():
    assert results.order_one(signals(shifts=low((6, 7), 1))).holds is True
    assert results.order_one(signals(shifts=low((6, 7), 8))).holds is False


def changed(at, sizes, passes=(6,)):
    return {
        loss: MESH + size * MESH.std() * in_passes(*passes) + at * in_passes(5)
        for loss, size in zip((0.25, 0.5), sizes, strict=True)
    }


def test_p4_is_the_rms_of_the_change_in_pass_six():
    found = results.marked_change(signals(losses=changed(0, (0.25, 0.5))))
    assert found.holds is True
    assert_allclose([found.numbers[f"pass 6, loss {loss}"] for loss in (0.25, 0.5)], [0.25, 0.5], rtol=1e-12)
    assert found.numbers["pass 5, loss 0.5"] == 0


@pytest.mark.parametrize(
    "losses",
    [changed(0, (0.1, 0.5)), changed(0, (0.5, 0.4)), changed(0.3, (0.25, 0.5)), changed(0, (0.3, 0.5), (7,))],
    ids=["too small", "not more", "before it", "after it"],
)
def test_p4_does_not_hold_for_another_change(losses):
    assert results.marked_change(signals(losses=losses)).holds is False


def scaled(**by_pass):
    factor = np.ones(N)
    for name, value in by_pass.items():
        factor[in_passes(int(name[1:])) > 0] = value
    return {0.25: MESH, 0.5: MESH * factor}


def test_p5_compares_the_passes():
    found = results.pass_seven_largest(signals(losses=scaled(p6=0.5, p7=2.0)))
    assert (found.holds, found.value) == (True, pytest.approx(2.0))
    assert found.numbers["pass 6"] == pytest.approx(0.5)
    assert results.pass_seven_largest(signals(losses=scaled(p7=1.4))).holds is False
    assert results.pass_seven_largest(signals(losses=scaled(p7=2.0, p8=2.5))).holds is False


def test_p5_the_rest_looks_about_180_degrees():
    quiet = {0.25: MESH, 0.5: MESH * (1 - 0.9 * in_passes(6, 7)) * (1 - 0.2 * in_passes(8, 9))}
    found = results.vanishing_and_reduced(signals(losses=quiet))
    assert (found.holds, found.value) == (True, pytest.approx(0.1, rel=1e-3))
    assert 165 <= found.numbers["its angle [deg]"] <= 195
    assert found.numbers["pass 8"] == pytest.approx(0.8)
    assert results.vanishing_and_reduced(signals(losses=scaled(p10=0.0, p8=0.8, p9=0.8))).holds is False
    loud = {0.25: MESH, 0.5: quiet[0.5] * (1 + in_passes(9))}
    assert results.vanishing_and_reduced(signals(losses=loud)).holds is False


def burst(centre, size):
    """A short pulse: a bar across all orders."""
    return size * bump(centre, 6) * np.cos(6 * (THETA - np.deg2rad(centre)))


def losses_of(small, great):
    return {0.25: MESH + small, 0.5: MESH + great}


def test_p6_finds_a_cross_at_pass_six():
    found = results.cross_of_the_loss(signals(losses=losses_of(burst(165, 0.5), burst(165, 1.0))))
    assert found.holds is True
    assert found.numbers["pass with the greatest arms"] == 6
    # Twice the pulse has twice the orders below the mesh.
    assert found.numbers["below mesh order, loss 0.5"] == pytest.approx(
        2 * found.numbers["below mesh order, loss 0.25"], rel=1e-9
    )


@pytest.mark.parametrize(
    "losses",
    [
        losses_of(0, 0),
        losses_of(burst(285, 0.5), burst(285, 1.0)),
        losses_of(burst(165, 1.0), burst(165, 1.0)),
        losses_of(burst(165, 0.5), burst(165, 1.0) - MESH * in_passes(9, 10, 11, 12)),
    ],
    ids=["nothing", "at pass 10", "as much at 25 %", "a gap in the ridge"],
)
def test_p6_does_not_hold_without_it(losses):
    assert results.cross_of_the_loss(signals(losses=losses)).holds is False


def test_p7_is_reported_without_a_verdict():
    found = results.single_pitted_tooth(signals(pitted=MESH + 0.1 * np.cos(13 * THETA)))
    assert found.holds is None
    assert found.value == pytest.approx(0.1)


def test_p8_wants_a_cross_larger_than_that_of_one_pitted_tooth():
    assert results.large_cross(signals(pitted=MESH + burst(165, 0.2), broken=MESH + burst(165, 2.0))).holds is True
    assert results.large_cross(signals(pitted=MESH + burst(165, 2.0), broken=MESH + burst(165, 2.0))).holds is False
    assert results.large_cross(signals(pitted=MESH, broken=MESH + burst(285, 2.0))).holds is False


def test_p9_looks_for_order_fourteen_and_passes_four_and_five():
    neighbours = 0.02 * (np.cos(13 * THETA) + np.cos(15 * THETA))
    found = results.no_order_fourteen(signals(broken=MESH + neighbours + 0.01 * np.cos(14 * THETA)))
    assert (found.holds, found.value) == (True, pytest.approx(0.5))
    line = results.no_order_fourteen(signals(broken=MESH + neighbours + 0.04 * np.cos(14 * THETA)))
    assert (line.holds, line.value) == (False, pytest.approx(2.0))
    early = MESH + neighbours + 0.4 * in_passes(4)
    assert results.no_order_fourteen(signals(broken=early)).holds is False


def test_every_claim_has_an_id_of_its_own_and_the_checks_are_these():
    kinds = {claim.id: claim.kind for claim in CLAIMS}
    assert [name for name, kind in kinds.items() if kind == "check"] == ["P1", "P2", "P3", "P4", "P5", "P6"]
    assert set(kinds) == {*(f"P{i}" for i in range(1, 10)), "P3, order 1", "P5, the rest"}


def test_a_tone_is_a_ridge_without_arms():
    W = measures.distribution(MESH)
    assert measures.continuity(W, TEETH) == pytest.approx(1, rel=1e-6)
    assert measures.arms(W, TEETH).max() < 0.01
    assert measures.component(W, 8, TEETH, (6, 7))[0] == pytest.approx(0, abs=0.01)


def test_the_least_amplitude_is_found_where_it_is():
    quiet = MESH * (1 - 0.8 * in_passes(6))
    least, angle = measures.least_amplitude(quiet, TEETH, 165, 15)
    assert least == pytest.approx(0.2, rel=0.01)
    assert angle == pytest.approx(165, abs=1)


def test_sidebands_are_five_pairs():
    inside = 0.1 * np.cos(7 * THETA) + 0.2 * np.cos(17 * THETA)
    outside = np.cos(6 * THETA) + np.cos(18 * THETA)
    assert measures.sidebands(MESH + inside + outside, TEETH) == pytest.approx(0.3, rel=1e-9)


@pytest.mark.parametrize(
    ("order", "counts"), [(1, 0), (2, 0), (3, 1), (9, 1), (10, 0), (14, 0), (15, 1), (21, 1), (22, 0)]
)
def test_arms_lie_between_the_ridges(order, counts):
    """Bins of half an order, strictly more than two orders from 12 and from 0 and 24: 2 x 15 of them."""
    W = np.zeros((N, N))
    W[:, 2 * TEETH - 1 : 2 * TEETH + 2] = 2.0
    W[:, 2 * order] = -1.0
    assert_allclose(measures.arms(W, TEETH), counts / 30 / 2)
