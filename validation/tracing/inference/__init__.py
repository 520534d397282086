"""The score of a record beside a fit, how often chance makes as large an effect, and which are not told apart.

Read :mod:`discrepancy` first (the model of a record), then :mod:`score`, :mod:`chance`, :mod:`front_runners`,
:mod:`decision`, :mod:`limits`.
"""

from validation.tracing.inference.decision import ALPHA, Decision, decide, learnt_prior
from validation.tracing.inference.limits import times_needed

__all__ = ["ALPHA", "Decision", "decide", "learnt_prior", "times_needed"]
