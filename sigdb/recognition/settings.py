"""The section ``[recognition]`` of a recipe."""

from typing import Literal

from pydantic import Field

from sigdb.core.fields import Section, quantity


class Recognition(Section):
    """How damage is learnt."""

    learner: Literal["lda", "boosting"] = Field(
        default="boosting", description="Shrinkage linear discriminant analysis, or gradient boosting of histograms."
    )
    folds: int = quantity("-", "Folds of specimens; one is held out for evaluation.", ge=3, default=5)
    seed: int = quantity("-", "Seed of training.", ge=0, default=0)
