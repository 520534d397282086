"""How often the test names an effect that is not there, over alpha: clean rigs of three makes, and spoiled sensors.

    python -m validation.practice.false_claims --seed 7 --count 51 --out claims.jsonl

Every case is traced at each alpha, by the test alone. A line is appended to the file for every case, and cases that
have a line are not traced again. A seed is used once, after the last change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from validation.practice.gate import Asked, outcome, rate, traced
from validation.practice.kept_lines import Score, run

ALPHAS = (0.01, 0.05, 0.2)
ROWS = ("clean", "sensors")


@dataclass(frozen=True)
class Claims:
    """A case, and what the test says of it at each of :data:`ALPHAS`.

    ``false`` has the names that neither were injected nor describe the sensor, joined by "+", "" where there is none.
    """

    row: str
    seed: int
    number: int
    label: str
    p_none: tuple[float, ...]
    verdicts: tuple[str, ...]
    false: tuple[str, ...]
    seconds: float


def claims_of(asked: Asked) -> Claims:
    """Draw a case, and trace it at every alpha."""
    case, describes = asked.case()
    p_none, verdicts, false, spent = list[float](), list[str](), list[str](), 0.0
    for alpha in ALPHAS:
        trace, seconds = traced(case, alpha)
        assert trace.decision is not None  # these rigs are declared
        found = outcome(asked, case, trace, seconds, describes)
        p_none.append(trace.decision.p_none)
        verdicts.append(found.verdict)
        false.append("+".join({*found.named} - {*found.truth, *describes}) if found.names_falsely else "")
        spent += seconds
    return Claims(
        asked.row, asked.seed, asked.number, asked.label, tuple(p_none), tuple(verdicts), tuple(false), round(spent, 1)
    )


def table(lines: Sequence[Claims]) -> list[str]:
    """Rows of a Markdown table: false names at each alpha with exact 95 % intervals, for each kind of case."""
    out = ["| cases | " + " | ".join(f"alpha {alpha:g}" for alpha in ALPHAS) + " |", "|---" * (1 + len(ALPHAS)) + "|"]
    for row in ROWS:
        own = [one for one in lines if one.row == row]
        kinds = dict.fromkeys(sorted(one.label for one in own)) if row == "clean" else {}
        for name in [*kinds, row]:
            these = [one for one in own if name in (one.label, row)]
            if these:
                cells = [rate(sum(bool(one.false[k]) for one in these), len(these)) for k in range(len(ALPHAS))]
                out.append(f"| {name} | {' | '.join(cells)} |")
    return out


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace the cases that have no line yet, and print the table of all."""
    run(Score("validation.practice.false_claims", ROWS, 51, Asked, claims_of, Claims, table), arguments)


if __name__ == "__main__":
    main()
