"""The score of a record beside a fit, how often chance makes as large an effect, and which are not told apart.

Read :mod:`discrepancy` first (the model of a record), then :mod:`score`, :mod:`chance`, :mod:`front_runners`,
:mod:`decision`.
"""

from validation.tracing.inference.decision import ALPHA, Decision, decide

__all__ = ["ALPHA", "Decision", "decide"]
