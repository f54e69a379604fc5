"""Rows of a database by life and time, where its recipe has lives."""

import pandas as pd

from sigdb.core import InputError, validated
from sigdb.database import Database
from sigdb.sweep.design.life import Life


def life_rows(database: Database) -> pd.DataFrame:
    """Return the rows of the lives of a database with their times.

    Parameters
    ----------
    database
        A database whose recipe has a grid with ``life``.

    Returns
    -------
    pandas.DataFrame
        ``id``, ``specimen``, ``draw``, ``tooth``, ``status``, ``grid`` (its number, from 0), ``life`` (its number in
        the grid, from 0), ``time``, ``severity``, ``rate`` and ``exponent``. The order is that of grid, life, specimen,
        tooth, draw and time.

    Raises
    ------
    InputError
        If no grid has a life.
    """
    grids = database.manifest.resolved["sweep"]["grid"]
    lives = {number: grid["life"] for number, grid in enumerate(grids) if grid.get("life") is not None}
    if not lives:
        raise InputError(f"{database.store} has no lives; give a grid of its recipe the key life")
    parts, before = [], 0
    for number, life in lives.items():
        section = validated(Life, life, owner=f"{database.store}: grid {number + 1}")
        drawn = section.trajectories().drop_duplicates("life")[["life", "rate", "exponent"]]
        rows = database.sql(
            f"select id, specimen, draw, tooth, status, life_number - {before + 1} as life, life_time as time, "
            f"{section.size} as severity from cases "
            f"where life_number > {before} and life_number <= {before + section.lives}"
        )
        parts.append(rows.merge(drawn, on="life").assign(grid=number))
        before += section.lives
    order = ["grid", "life", "specimen", "tooth", "draw", "time"]
    return pd.concat(parts, ignore_index=True).sort_values(order, kind="stable", ignore_index=True)
