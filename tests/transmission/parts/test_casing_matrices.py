"""Unit: a casing given by its matrices is the casing given by its modes, in every file format, and what is refused."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import mmwrite, savemat
from scipy.sparse import coo_array

from sigdb.core.errors import InputError
from sigdb.transmission import load_transmission, modal_system
from sigdb.transmission.system.assembly import assemble

RIG = """
name = "boxed"
damping_ratio = 0.02
[operating]
shaft = "main"
speed_rpm = 1200.0
[materials.steel]
density = 7800.0
young_modulus = 2.1e11
shear_modulus = 8.1e10
[shafts.main]
axis = [1.0, 0.0, 0.0]
material = "steel"
segments = [{ length = 0.3, outer_diameter = 0.03, elements = 2 }]
[disks.disk]
shaft = "main"
node = 1
mass = 4.0
polar_inertia = 0.02
diametral_inertia = 0.01
unbalance = 1e-4
[bearings.left]
shaft = "main"
node = 0
seat = "left"
stiffness = [5e7, 5e7, 2e7]
[bearings.right]
shaft = "main"
node = 2
seat = "right"
stiffness = [5e7, 5e7, 0.0]
[sensors.wall]
point = "right"
direction = [0.0, 1.0, 0.5]
quantity = "displacement"
"""
POINTS = """
damping_ratio = 0.03
points.left = [0, 1, 2]
points.right = [3, 4, -1]
"""
# A casing of three moving motions at the left seat and two at the right one, all tied to the ground and each other.
MASS = np.diag([12.0, 12.0, 12.0, 9.0, 9.0]) + 0.8 * (np.eye(5, k=3) + np.eye(5, k=-3))
STIFFNESS = np.diag([6e8, 4e8, 9e8, 7e8, 5e8]) - 1.5e8 * (np.eye(5, k=3) + np.eye(5, k=-3)) - 3e7 * (np.eye(5) - 1)
STIFFNESS = STIFFNESS - 6e7 * (1 - np.eye(5))
OMEGA = 2 * np.pi * np.array([20.0, 300.0, 900.0, 1400.0])


def write(folder, kind):
    """The matrices in one format; returns the lines of the rig file that name them."""
    if kind == "npz":
        np.savez(folder / "box.npz", M=MASS, K=STIFFNESS)
        return 'file = "box.npz"\nmass = "M"\nstiffness = "K"'
    if kind == "mat":
        savemat(folder / "box.mat", {"M": MASS, "K": STIFFNESS})
        return 'file = "box.mat"\nmass = "M"\nstiffness = "K"'
    if kind == "mat-sparse":
        savemat(folder / "box.mat", {"M": coo_array(MASS).tocsc(), "K": coo_array(STIFFNESS).tocsc()})
        return 'file = "box.mat"\nmass = "M"\nstiffness = "K"'
    for name, one in (("M.mtx", MASS), ("K.mtx", STIFFNESS)):
        mmwrite(folder / name, coo_array(one) if kind == "mtx-sparse" else one)
    return 'mass = "M.mtx"\nstiffness = "K.mtx"'


@pytest.fixture
def boxed(tmp_path):
    """Load the rig with a casing of some lines, in a folder of its own."""

    def load(lines, points=POINTS):
        path = tmp_path / "boxed.toml"
        path.write_text(f"{RIG}[casing.matrices]\n{lines}\n{points}", encoding="utf-8")
        return load_transmission(path)

    return load


def held_matrices(tmp_path):
    return write(tmp_path, "npz")


@pytest.mark.parametrize("kind", ["npz", "mat", "mat-sparse", "mtx", "mtx-sparse"])
def test_every_format_gives_the_casing_of_its_matrices(boxed, tmp_path, kind):
    """The rig solved directly with the casing's own matrices in place of its modes; damping of every mode 3 %."""
    rig = boxed(write(tmp_path, kind))
    assert len(rig.casing.modes) == 5
    assert rig.casing.points == ("left", "right")

    data = rig.model_dump()
    data["casing"] = {"modes": ()}
    for bearing in data["bearings"].values():
        bearing["seat"] = None
    data["sensors"] = {}
    parts = assemble(type(rig).model_validate(data))
    n = len(parts.mass)
    mass, stiffness, damping = np.zeros((3, n + 5, n + 5))
    mass[:n, :n], mass[n:, n:] = parts.mass, MASS
    damping[:n, :n] = parts.damping + parts.gyroscopic
    # A shaft along X has its own x along -Z and its z along X (its y is vertical); seats' springs are 5e7, 5e7, 2e7.
    rotation = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    assert_allclose(rig.shafts["main"].rotation, rotation, atol=1e-15)
    stiffness[:n, :n] = parts.stiffness
    for node, springs, degrees in ((0, (5e7, 5e7, 2e7), (0, 1, 2)), (2, (5e7, 5e7, 0.0), (3, 4, None))):
        for axis, k in enumerate(springs):
            b = np.zeros(n + 5)
            b[6 * node + axis] = 1
            for i, dof in enumerate(degrees):
                if dof is not None:
                    b[n + dof] -= rotation[i, axis]
            b_ground = np.zeros(n + 5)
            b_ground[6 * node + axis] = 1
            stiffness += k * (np.outer(b, b) - np.outer(b_ground, b_ground))
    stiffness[n:, n:] += STIFFNESS

    def root(matrix_k, matrix_m):
        """M (M^-1 K)^(1/2) by its eigenvectors."""
        squares, shapes = np.linalg.eig(np.linalg.solve(matrix_m, matrix_k))
        return matrix_m @ (shapes * np.sqrt(squares.clip(min=0))) @ np.linalg.inv(shapes)

    # The rotor's damping acts on its motion less that with which it follows the casing statically.
    followed = np.linalg.lstsq(parts.stiffness, stiffness[:n, n:], rcond=1e-12)[0]
    relative = np.hstack([np.eye(n), followed])
    damping += relative.T @ (2 * 0.02 * root(parts.stiffness, parts.mass).real) @ relative
    damping[n:, n:] += 2 * 0.03 * root(STIFFNESS, MASS).real
    found = modal_system(rig).transfer(OMEGA)[:, 0, 2:] @ [1, -1j]
    force = np.zeros(n + 5, complex)
    speed = 2 * np.pi * 20
    force[6:8] = 1e-4 * speed**2 * np.array([1, -1j])
    seen = np.zeros(n + 5)
    seen[n + 4] = 1.0 / np.hypot(1, 0.5)
    exact = [seen @ np.linalg.solve(stiffness + 1j * w * damping - w**2 * mass, force) for w in OMEGA]
    assert_allclose(np.abs(found - exact), 0, atol=1e-8 * np.abs(exact).max())


def test_a_motion_of_minus_one_stays_at_rest(boxed, tmp_path):
    rig = boxed(held_matrices(tmp_path))
    assert all(mode.shape["right"][2] == 0 for mode in rig.casing.modes)
    assert any(abs(mode.shape["right"][1]) > 0.01 for mode in rig.casing.modes)


def test_modes_are_mass_normalised_with_the_frequencies_of_the_matrices(boxed, tmp_path):
    rig = boxed(held_matrices(tmp_path))
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(MASS, STIFFNESS)).real)
    found = [mode.frequency_hz for mode in rig.casing.modes]
    assert_allclose(found, np.sqrt(squares) / (2 * np.pi), rtol=1e-10)
    assert all(mode.modal_mass == 1.0 and mode.damping_ratio == 0.03 for mode in rig.casing.modes)
    # Shapes of unit modal mass: over all modes they add up to the inverse of the mass matrix.
    shapes = np.array([[*mode.shape["left"], *mode.shape["right"][:2]] for mode in rig.casing.modes]).T
    assert_allclose(shapes @ shapes.T, np.linalg.inv(MASS), atol=1e-12)


def test_only_the_lowest_modes_are_kept_where_asked(boxed, tmp_path):
    everything = boxed(held_matrices(tmp_path)).casing.modes
    few = boxed(held_matrices(tmp_path), POINTS.replace("points.left", "modes = 2\npoints.left")).casing.modes
    assert [mode.frequency_hz for mode in few] == [mode.frequency_hz for mode in everything[:2]]
    shapes = [np.array([*mode.shape["left"], *mode.shape["right"]]) for mode in (*few, *everything[:2])]
    assert_allclose(np.abs(shapes[:2]), np.abs(shapes[2:]), rtol=1e-12)


def refused(boxed, message, lines, points=POINTS):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        boxed(lines, points)
    assert all("boxed.toml" in line for line in str(caught.value).splitlines())


def test_files_that_cannot_be_read_are_named(boxed, tmp_path):
    refused(boxed, "absent.npz cannot be read", 'file = "absent.npz"\nmass = "M"\nstiffness = "K"')
    refused(boxed, "absent.mat cannot be read", 'file = "absent.mat"\nmass = "M"\nstiffness = "K"')
    refused(boxed, "M.mtx cannot be read", 'mass = "M.mtx"\nstiffness = "K.mtx"')
    (tmp_path / "box.csv").write_text("1,2\n")
    refused(boxed, "its name must end in .npz or .mat", 'file = "box.csv"\nmass = "M"\nstiffness = "K"')


@pytest.mark.parametrize("content", [b"", b"this is no matrix at all", b"x" * 300], ids=["empty", "text", "long"])
@pytest.mark.parametrize("name", ["box.npz", "box.mat", "M.mtx"])
def test_files_that_hold_no_matrix_are_named(boxed, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    lines = f'file = "{name}"\nmass = "M"\nstiffness = "K"'
    refused(boxed, f"{name} cannot be read", lines if name != "M.mtx" else 'mass = "M.mtx"\nstiffness = "M.mtx"')


@pytest.mark.parametrize("length", [30, 100, 200])
@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_files_that_are_cut_short_are_named(boxed, tmp_path, kind, length):
    lines, path = write(tmp_path, kind), tmp_path / f"box.{kind}"
    path.write_bytes(path.read_bytes()[:length])
    refused(boxed, f"box.{kind} ", lines)


def test_a_single_array_under_the_name_of_an_npz_file_is_refused(boxed, tmp_path):
    np.save(tmp_path / "one.npy", MASS)
    (tmp_path / "one.npy").rename(tmp_path / "box.npz")
    refused(boxed, "box.npz cannot be read", 'file = "box.npz"\nmass = "M"\nstiffness = "K"')


def test_a_missing_array_is_named_with_those_that_there_are(boxed, tmp_path):
    lines = held_matrices(tmp_path).replace('"K"', '"stiffness"')
    refused(boxed, "box.npz holds no array 'stiffness'; it holds M, K", lines)


def test_pickled_objects_are_not_read(boxed, tmp_path):
    class Trap:
        def __reduce__(self):
            return (open, (str(tmp_path / "sprung"), "w"))

    np.savez(tmp_path / "box.npz", M=np.array([Trap()], dtype=object), K=STIFFNESS)
    (tmp_path / "sprung").unlink(missing_ok=True)
    refused(boxed, "box.npz cannot be read", 'file = "box.npz"\nmass = "M"\nstiffness = "K"')
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    ("mass", "stiffness"),
    [(MASS[:4], STIFFNESS), (MASS, STIFFNESS[:, :4]), (MASS[:4, :4], STIFFNESS), (MASS[0], STIFFNESS)],
)
def test_matrices_must_be_square_and_alike(boxed, tmp_path, mass, stiffness):
    np.savez(tmp_path / "box.npz", M=mass, K=stiffness)
    refused(boxed, "must be square and alike", 'file = "box.npz"\nmass = "M"\nstiffness = "K"')


def test_matrices_must_hold_finite_real_numbers(boxed, tmp_path):
    for bad in (np.where(np.eye(5) == 1, np.nan, STIFFNESS), STIFFNESS + np.inf, STIFFNESS * 1j, STIFFNESS.astype(str)):
        np.savez(tmp_path / "box.npz", M=MASS, K=np.char.add(bad, "N/m") if bad.dtype.kind == "U" else bad)
        refused(boxed, "casing.matrices", 'file = "box.npz"\nmass = "M"\nstiffness = "K"')


def test_a_casing_must_be_held_and_have_mass_everywhere(boxed, tmp_path):
    free = STIFFNESS - np.diag(STIFFNESS.sum(axis=1))
    np.savez(tmp_path / "box.npz", M=MASS, K=free, massless=np.diag([1.0, 1.0, 1.0, 1.0, 0.0]), held=STIFFNESS)
    refused(boxed, "the casing can move freely; hold it", 'file = "box.npz"\nmass = "M"\nstiffness = "K"')
    lines = 'file = "box.npz"\nmass = "massless"\nstiffness = "held"'
    refused(boxed, "the mass matrix is not positive definite; leave out massless motions", lines)


def test_points_must_be_among_the_degrees_of_freedom(boxed, tmp_path):
    for wrong in (5, -2):
        points = POINTS.replace("[3, 4, -1]", f"[3, {wrong}, -1]")
        refused(
            boxed,
            f"casing.matrices.points.right = [3, {wrong}, -1] must be from -1 to 4",
            held_matrices(tmp_path),
            points,
        )


def test_modes_and_matrices_are_not_given_both(boxed, tmp_path):
    mode = "[[casing.modes]]\nfrequency_hz = 100.0\ndamping_ratio = 0.1\nmodal_mass = 1.0\nshape.left = [1, 0, 0]\n"
    lines = held_matrices(tmp_path)
    refused(boxed, "casing.modes and casing.matrices are both given; give one of them", lines, POINTS + mode)


def test_unknown_keys_of_the_matrices_are_named(boxed, tmp_path):
    refused(boxed, "did you mean 'damping_ratio'?", held_matrices(tmp_path), POINTS.replace("damping_", "dampng_"))


def test_a_casing_that_is_no_table_is_refused(tmp_path):
    path = tmp_path / "boxed.toml"
    path.write_text('casing = "box"\n' + RIG, encoding="utf-8")
    with pytest.raises(InputError, match=r"boxed\.toml: casing"):
        load_transmission(path)
    path.write_text(RIG + "[casing]\nmatrices = 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"boxed\.toml"):
        load_transmission(path)
