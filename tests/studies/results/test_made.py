"""The key ``made``: the command as it was given, for a shell; of a file that was sent, nothing else is shown."""

import json
import shlex
from dataclasses import asdict, replace

import pytest
from how_made import MADE, printed
from results_folder import write_study, write_trace

from hysteresis.plain import from_plain
from hysteresis.records.record import RecordError
from studies.commands import cli
from studies.commands.cli import call
from studies.report import write_report
from studies.results.made import MOST_COMMAND, Made, made_entry, made_now
from studies.results.run import RunSummary


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("command", 3, "made: command: 3: expected text"),
        ("command", "rm -rf DIR", "made: command = 'rm -rf DIR': expected one call of notchbend"),
        ("command", "notchbend report a; rm -rf b", "expected one call of notchbend"),
        ("command", "notchbend report $(rm a)", "expected one call of notchbend"),
        ("command", "notchbend report a\nrm b", "expected one call of notchbend"),
        ("command", "notchbend report 'a", "expected one call of notchbend"),
        ("command", "notchbend report " + MOST_COMMAND * "a", f"at most {MOST_COMMAND} characters"),
        ("date", "yesterday", "made: date = 'yesterday': expected the form 2026-01-31 12:00 UTC"),
        ("date", None, "made: date: None: expected text"),
        ("commit", "<b>", "made: commit = '<b>': expected at most 40"),
        ("commit", "0" * 41, "expected at most 40"),
    ],
)
def test_what_is_no_call_of_notchbend_is_refused(key, value, said, tmp_path):
    write_trace(tmp_path)
    stored = json.loads((tmp_path / "trace.json").read_text())
    (tmp_path / "trace.json").write_text(json.dumps(stored | {"made": {**asdict(MADE), key: value}}))
    with pytest.raises(RecordError) as caught:
        write_report(tmp_path)
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'trace.json'}: made: {key}")
    assert len(str(caught.value)) < 300 + len(str(tmp_path))


def test_a_file_without_it_and_one_with_null_are_read(tmp_path):
    write_trace(tmp_path)
    stored = json.loads((tmp_path / "trace.json").read_text())
    for values in ({key: value for key, value in stored.items() if key != "made"}, stored | {"made": None}):
        (tmp_path / "trace.json").write_text(json.dumps(values))
        page = write_report(tmp_path).read_text()
        assert "Made by" not in page
        assert f"<code>notchbend trace bench.csv --out {tmp_path}</code>" in page  # made again from the result


def test_results_of_several_commands_each_say_how_they_were_made(tmp_path):
    """A word DIR of a command that was given stays: it is a folder of the user's."""
    write_trace(tmp_path)
    write_study(tmp_path)
    other = replace(MADE, command="notchbend study 'my study.toml' --out DIR", commit="")
    facts = json.loads((tmp_path / "study.json").read_text())
    (tmp_path / "study.json").write_text(json.dumps(facts | made_entry(other)))
    page = write_report(tmp_path).read_text()
    assert f"Made by <code>{MADE.command}</code>, commit 0123abc, 2026-11-23 08:00 UTC. " in page
    said = "notchbend study &#39;my study.toml&#39; --out DIR"
    assert f"Made by <code>{said}</code>, 2026-11-23 08:00 UTC. " in page
    assert f'<p class="again"><code>{said}</code></p>' in page


def test_the_command_is_the_one_given_without_what_changes_no_result():
    """Options of output are left out where they are options, and kept where they are names."""
    given = ["a b.csv", "--out", "--json", "--quiet", "$x", "--", "--force"]
    line = cli._command_line(given, {"quiet": True, "json": False, "force": False})
    assert line == "notchbend 'a b.csv' --out --json '$x' -- --force"
    assert shlex.split(line)[1:] == [word for word in given if word != "--quiet"]
    assert Made(line, MADE.date, "").command == line
    assert cli._command_line(["r\udcff.csv"], {}) == r"notchbend 'r\udcff.csv'"  # a byte that is not UTF-8


def test_a_call_from_python_or_a_line_beyond_all_measure_has_none():
    assert made_now("") is None
    assert made_now("notchbend " + MOST_COMMAND * "a") is None
    assert made_entry(None) == {}


def test_the_summary_of_an_earlier_version_is_read():
    """Its command was written by the package, with the words quoted alike."""
    command = "notchbend run --rig 'my rig.toml' --preload 10 --preload 20 bench.csv --seed 3 --out results/first"
    assert from_plain(Made, {"command": command, "date": MADE.date, "commit": ""}).command == command
    assert RunSummary.__dataclass_fields__["made"].default is None


def test_reports_leave_it_alone(tmp_path):
    write_trace(tmp_path)
    before = (tmp_path / "trace.json").read_bytes()
    assert call(["report", str(tmp_path), "--quiet"]) == 0
    assert (tmp_path / "trace.json").read_bytes() == before
    printed(tmp_path / "trace.json", (tmp_path / "report.html").read_text(), shlex.split(MADE.command)[1:])
