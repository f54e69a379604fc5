"""Ensembles: rigs drawn from what is assumed of one, without those that cannot be."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

from sigdb.core import InputError, NotApplicableError, SigdbError, UnstableRigError
from sigdb.dynamics.period import damaged_gear, repeats
from sigdb.dynamics.periodic.prepare import prepare_periodic
from sigdb.transmission import Choice, Seed, Transmission, as_transmission, draws, modal_system, small_matrices

if TYPE_CHECKING:
    from os import PathLike

    import pandas as pd

INVALID = "numbers that do not go together"
FREE = "parts that move freely"
UNSTEADY = "no steady state under the torque"
UNSTABLE = "unstable"
OPEN = "a mesh that opens when healthy"
REASONS = (INVALID, FREE, UNSTEADY, UNSTABLE, OPEN)
"""Why a rig cannot be."""

SAMPLES_PER_TOOTH = 32
"""Samples in a tooth pass when the contact of a healthy rig is looked at: the least force needs no more."""

MOST_IN_A_ROW = 256
"""Rigs in a row that cannot be, after which an ensemble is given up."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Ensemble(Sequence[Transmission]):
    """Rigs drawn from what is assumed of one.

    Attributes
    ----------
    rig : Transmission
        The rig that they were drawn from.
    members : tuple of Transmission
        The rigs.
    values : tuple of dict
        Values of each member's free numbers, by full dotted path.
    left_out : dict
        How many draws before the last member were left out, by reason.
    """

    rig: Transmission
    members: tuple[Transmission, ...]
    values: tuple[Mapping[str, Choice], ...]
    left_out: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.members)

    @overload
    def __getitem__(self, number: int) -> Transmission: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[Transmission, ...]: ...
    def __getitem__(self, number: int | slice) -> Transmission | tuple[Transmission, ...]:
        return self.members[number]

    def __repr__(self) -> str:
        reasons = ", ".join(f"{count} {reason}" for reason, count in self.left_out.items() if count)
        total = sum(self.left_out.values())
        return (
            f"<Ensemble of {len(self)} rigs from {self.rig.name!r}, {len(self.rig.assumptions.free)} free numbers; "
            f"left out {total}{f': {reasons}' if reasons else ''}>"
        )

    def to_pandas(self) -> "pd.DataFrame":
        """Return the values of the members' free numbers as a table: a row a member, a column a dotted path.

        A number that a member does not have, by another choice of a table, is nan.
        """
        import pandas as pd

        columns = dict.fromkeys(number.path for number in self.rig.assumptions.free)
        return pd.DataFrame(list(self.values), columns=list(columns)).rename_axis(index="member")


def ensemble(rig: "Transmission | str | PathLike[str]", n: int, *, rng: Seed = None) -> Ensemble:
    """Draw rigs from what is assumed of one, leaving out those that cannot be.

    The draws are points of a scrambled Sobol sequence over the ranges and choices; member k does not depend on n. A
    draw is left out if a rule refuses it, a part moves freely, the torque pulls the teeth of a mesh apart, the varying
    mesh stiffness makes it unstable, or a mesh opens without damage, by the linear periodic solution. In place of a
    hunting train that repeats too late for that solution, the nearest train that does not is solved: its mesh
    frequencies differ by 0.5 % or less, if there is such a train.

    Parameters
    ----------
    rig : Transmission, str or path
        A rig with assumed numbers, the name of a built-in one, or a rig file.
    n : int
        Number of members.
    rng : int, SeedSequence, Generator or None
        Seed or generator; the same seed draws the same rigs.

    Returns
    -------
    Ensemble
        A sequence of the members, with the values of their free numbers and counts of what was left out.

    Raises
    ------
    TypeError
        If the rig is of another type.
    InputError
        If nothing of the rig is free, n is not positive, or none of many draws in a row can be.

    Examples
    --------
    >>> import sigdb
    >>> rigs = sigdb.ensemble("nasa-spiral-bevel", 2, rng=1)
    >>> len(rigs), rigs[0] == sigdb.ensemble("nasa-spiral-bevel", 1, rng=1)[0]
    (2, True)
    """
    rig = as_transmission(rig)
    if isinstance(n, bool) or not isinstance(n, int) or n < 1:
        raise InputError(f"n = {n!r} must be a whole number, 1 or more")
    members: list[Transmission] = []
    drawn: list[Mapping[str, Choice]] = []
    left_out = Counter(dict.fromkeys(REASONS, 0))
    in_a_row = 0
    for values in draws(rig, rng):
        member = possible_rig(rig, values)
        if isinstance(member, str):
            left_out[member] += 1
            in_a_row += 1
            if in_a_row == MOST_IN_A_ROW:
                counts = ", ".join(f"{count} {reason}" for reason, count in left_out.items() if count)
                raise InputError(
                    f"rig {rig.name!r}: {in_a_row} draws in a row cannot be ({counts}); narrow what is assumed of it"
                )
            continue
        in_a_row = 0
        members.append(member)
        drawn.append(values)
        if len(members) == n:
            break
    return Ensemble(rig=rig, members=tuple(members), values=tuple(drawn), left_out=dict(left_out))


def possible_rig(rig: Transmission, values: Mapping[str, Choice]) -> Transmission | str:
    """Return a rig with other values of its assumed numbers, or the reason of `REASONS` for which it cannot be."""
    try:
        member = rig.with_assumed(values)
    except InputError:
        return INVALID
    return _impossible(member) or member


@small_matrices
def _impossible(rig: Transmission) -> str | None:
    """Return why a rig cannot be; None for one that can.

    Without torque through meshes only its parts must be held.
    """
    try:
        system = modal_system(rig)
    except InputError:
        return FREE
    operating = rig.operating
    if not rig.meshes or operating.drive is None or not operating.torque or not operating.speed_rpm:
        return None
    gear = damaged_gear(rig, None)
    try:
        prepared = prepare_periodic(
            rig,
            gear=gear,
            samples_per_tooth=SAMPLES_PER_TOOTH,
            system=system,
            refine=False,
            nearest=not repeats(rig, gear),
        )
        prepared.floquet_multiplier([{}])
        state = prepared.steady_state([{}], specimens=False)
    except (UnstableRigError, NotApplicableError):  # a motion that is not finite is not applicable
        return UNSTABLE
    except InputError:
        return UNSTEADY
    except SigdbError:  # the iteration does not converge
        return UNSTABLE
    return OPEN if state.contact_loss[0] else None
