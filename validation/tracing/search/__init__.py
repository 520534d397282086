"""Search for effects beside a baseline model: starting points, candidates, stepwise selection, refits."""

from validation.tracing.search.final_fit import refit_without_heldout
from validation.tracing.search.restarts import best_of_other_loops
from validation.tracing.search.search import Search
from validation.tracing.search.stepwise import select_effects

__all__ = ["Search", "best_of_other_loops", "refit_without_heldout", "select_effects"]
