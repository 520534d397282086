"""What a user runs: command line, main job, report."""
