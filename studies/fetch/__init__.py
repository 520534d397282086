"""Measured records of other groups, fetched from their public repositories."""

from studies.fetch.catalogue import CATALOGUE, SOURCES_ONLY
from studies.fetch.download import FetchError, fetch_record

__all__ = ["CATALOGUE", "SOURCES_ONLY", "FetchError", "fetch_record"]
