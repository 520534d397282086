"""One device over days or uses: what has changed since when, why, and when a limit will be passed."""

from studies.follow.result import FollowReport
from studies.follow.work import FollowSettings, follow_loaded

__all__ = ["FollowReport", "FollowSettings", "follow_loaded"]
