"""Unit: splits of measured rows keep averages of a recording together, and a leak must be allowed."""

import numpy as np
import pandas as pd
import pytest

from sigdb.core.errors import InputError
from sigdb.database import make_split


@pytest.fixture
def rows():
    """Four machines of four recordings of three averages; the last two recordings of each are damaged."""
    machine, recording, draw = (each.ravel() for each in np.meshgrid(range(4), range(4), range(3), indexing="ij"))
    return pd.DataFrame(
        {
            "machine": [f"m{each}" for each in machine],
            "recording": [f"m{a}-{b}" for a, b in zip(machine, recording, strict=True)],
            "specimen": 4 * machine + recording,
            "draw": draw,
            "load": 10.0 * (recording % 2),
            "set": "",
            "tooth": np.where(recording > 1, 1 + machine, 0),
            "teeth": 12,
        }
    )


@pytest.mark.parametrize(("name", "groups"), [("recording", "recording"), ("machine", "machine"), ("load", "load")])
def test_each_value_of_the_column_is_on_one_side(rows, name, groups):
    folds = make_split(name, rows, seed=0, folds=4).folds(rows)
    sides = pd.Series(folds).groupby(rows[groups].to_numpy()).nunique()
    assert (sides == 1).all()
    assert (pd.Series(folds).groupby(rows["recording"].to_numpy()).nunique() == 1).all()
    assert set(folds) == {"training", "test"}


def test_a_random_split_is_refused_and_marked_where_it_is_allowed(rows):
    with pytest.raises(InputError, match="averages of one recording into training and test"):
        make_split("random", rows, seed=0, folds=4)
    split = make_split("random", rows, seed=0, folds=4, allow_leak=True)
    assert split.text.startswith("LEAKS")
    sides = pd.Series(split.folds(rows)).groupby(rows["recording"].to_numpy()).nunique()
    assert (sides == 2).any()


@pytest.mark.parametrize(
    ("name", "measured", "message"),
    [
        ("S1", True, "measured rows are split by recording, machine, load, set"),
        ("machine", False, "it is of recordings; choose S0"),
        ("set", True, "split set needs two values or more of set"),
    ],
)
def test_a_split_of_other_rows_is_refused(rows, name, measured, message):
    with pytest.raises(InputError, match=message):
        make_split(name, rows if measured else rows.drop(columns="recording"), seed=0, folds=4)


def test_a_fold_without_damage_is_refused(rows):
    rows["tooth"] = np.where(rows["machine"] == "m0", 3, 0)
    with pytest.raises(InputError, match="no rows of the classes"):
        make_split("machine", rows, seed=0, folds=4)
