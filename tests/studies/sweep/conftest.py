"""Studies that several tests read."""

import pytest
from once import made_once
from small_study import LONG, study_file

from studies.sweep import open_study, read_study, run_study


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """The grid, run by two workers: its folder and its summary."""
    folder = tmp_path_factory.mktemp("study")
    summary = run_study(read_study(study_file(folder)), folder / "out", workers=2)
    return folder, summary


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """The dataset of the 240 cases of LONG, run without interruption."""

    def make(folder):
        folder.mkdir()
        run_study(read_study(study_file(folder, LONG)), folder / "out", workers=2)

    return open_study(made_once(tmp_path_factory, "undisturbed", make) / "out")
