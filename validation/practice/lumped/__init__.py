"""Another generator of practice records: a lumped rig that shares no law with the tracer's models."""

from validation.practice.lumped.rig import LumpedRig, simulate_lumped

__all__ = ["LumpedRig", "simulate_lumped"]
