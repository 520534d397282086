"""What ``import notchbend`` offers to a notebook or a script: the work of the commands as functions, and figures."""

from studies.notebook.results import Compensation, StudyResult

__all__ = ["Compensation", "StudyResult"]
