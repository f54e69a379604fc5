"""A casing given by its matrices, as a finite-element program writes them: read from a file and turned into modes."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, Strict
from scipy.linalg import eigh

from sigdb.core import FloatArray, InputError, quantity
from sigdb.transmission.parts.described import Described
from sigdb.transmission.parts.supports import CasingMode

Degrees = Annotated[tuple[int, int, int], Strict(False)]


class CasingMatrices(Described):
    """Mass and stiffness matrices of a held casing without its rotors, equation (2), and where its points are.

    ``mass`` and ``stiffness`` are files in MatrixMarket format, or names of arrays in ``file`` (NPZ or MAT). Paths are
    taken from the rig file's folder. A degree of freedom of -1 is one that does not move.
    """

    file: str | None = Field(default=None, description="NPZ or MAT file that holds both matrices.")
    mass: str = Field(description="Array of the file, or a MatrixMarket file: mass matrix, kg.")
    stiffness: str = Field(description="Array of the file, or a MatrixMarket file: stiffness matrix, N/m.")
    points: dict[str, Degrees] = Field(description="Degrees of freedom of X, Y, Z of each point, from 0; -1 for none.")
    damping_ratio: float = quantity("-", "Fraction of critical damping of every mode.", ge=0, lt=1)
    modes: int | None = quantity("-", "Number of modes to keep, the lowest; all if left out.", ge=1, default=None)

    def casing_modes(self, folder: Path) -> list[CasingMode]:
        """The casing's modes, mass-normalised.

        Raises
        ------
        InputError
            If a file cannot be read, the matrices do not fit, or the casing is not held.
        """
        mass, stiffness = (self._matrix(folder, name) for name in (self.mass, self.stiffness))
        n = len(mass)
        if mass.shape != (n, n) or stiffness.shape != (n, n):
            raise InputError(
                f"casing.matrices: mass {mass.shape} and stiffness {stiffness.shape} must be square and alike"
            )
        for name, degrees in self.points.items():
            if not all(-1 <= degree < n for degree in degrees):
                raise InputError(f"casing.matrices.points.{name} = {list(degrees)} must be from -1 to {n - 1}")
        try:
            squares, shapes = eigh(_symmetric(stiffness), _symmetric(mass))
        except np.linalg.LinAlgError:
            raise InputError(
                "casing.matrices: the mass matrix is not positive definite; leave out massless motions"
            ) from None
        if squares[0] <= 1e-10 * squares[-1]:
            raise InputError(
                "casing.matrices: the casing can move freely; hold it to the ground in its stiffness matrix"
            )
        grounded = np.vstack([shapes, np.zeros(n)])  # row -1 does not move
        return [
            CasingMode(
                frequency_hz=float(np.sqrt(squares[i]) / (2 * np.pi)),
                damping_ratio=self.damping_ratio,
                modal_mass=1.0,
                shape={name: tuple(grounded[list(at), i].tolist()) for name, at in self.points.items()},
            )
            for i in range(n)[: self.modes]
        ]

    def _matrix(self, folder: Path, name: str) -> FloatArray:
        from scipy.io import mmread  # slow to load

        path = folder / (name if self.file is None else self.file)
        try:
            content: Any = mmread(path) if self.file is None else _arrays(path)
        except Exception as error:  # the readers raise a dozen kinds for a damaged file
            raise InputError(f"casing.matrices: {path} cannot be read ({error})") from None
        if self.file is not None:
            if name not in content:
                arrays = ", ".join(key for key in content if not key.startswith("_"))
                raise InputError(f"casing.matrices: {path} holds no array {name!r}; it holds {arrays}")
            content = content[name]
        dense = content.toarray() if hasattr(content, "toarray") else content
        matrix = np.asarray(dense)
        if matrix.dtype.kind not in "iuf" or not np.isfinite(matrix).all():
            raise InputError(f"casing.matrices: {name} must hold finite real numbers")
        return matrix.astype(float)


def _arrays(path: Path) -> Any:
    if path.suffix not in (".npz", ".mat"):
        raise ValueError("its name must end in .npz or .mat")
    # Opened here, since the readers leave a damaged file open.
    with path.open("rb") as file:
        if path.suffix == ".mat":
            from scipy.io import loadmat  # slow to load

            return loadmat(file)
        with np.load(file, allow_pickle=False) as content:
            return dict(content)


def _symmetric(matrix: FloatArray) -> FloatArray:
    return (matrix + matrix.T) / 2
