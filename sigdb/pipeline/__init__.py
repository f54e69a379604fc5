"""Whole recipes: databases, models with their reports, pictures, and the comparison with the paper."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "ModelResult",
    "Recipe",
    "RecipeRun",
    "assess_rows",
    "draw_among",
    "draw_coverage",
    "draw_rig",
    "draw_signature",
    "load_recipe",
    "run_recipe",
    "train_model",
]
