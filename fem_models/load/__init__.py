"""Load programs, what they do to a rig sample by sample, and the record of a run."""

from fem_models.load.program import LoadProgram, sine, triangle

__all__ = ["LoadProgram", "sine", "triangle"]
