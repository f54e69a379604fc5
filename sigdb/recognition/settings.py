"""The section ``[recognition]`` of a recipe."""

from typing import Literal

from pydantic import Field

from sigdb.core.fields import Section, quantity


class Recognition(Section):
    """How damage is learnt."""

    learner: Literal["lda", "boosting", "templates"] = Field(
        default="boosting",
        description="Shrinkage linear discriminant analysis, gradient boosting of histograms, or a bank of templates.",
    )
    folds: int = quantity("-", "Folds of specimens; one is held out for evaluation.", ge=3, default=5)
    seed: int = quantity("-", "Seed of training.", ge=0, default=0)
