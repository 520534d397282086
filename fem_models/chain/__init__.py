"""The chain of joints and tendon segments: a compiled engine, quasi-static, for searches and studies."""

from fem_models.chain.parameters import ChainSettings
from fem_models.chain.solve import simulate_chain, solve_batch, solve_chain

__all__ = ["ChainSettings", "simulate_chain", "solve_batch", "solve_chain"]
