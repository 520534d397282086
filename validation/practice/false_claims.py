"""How often the test names an effect that is not there, over alpha: clean rigs of three makes, and spoiled sensors.

    python -m validation.practice.false_claims --seed 7 --count 51 --out claims.jsonl

Every case is traced at each alpha, by the test alone. A line is appended to the file for every case, and cases that
have a line are not traced again. A seed is used once, after the last change.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path

from rich.progress import track

from hysteresis.plain import from_plain
from validation.practice.gate import Asked, outcome, rate, traced

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


def read_lines(path: Path) -> list[Claims]:
    """Read the cases that have a line."""
    text = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [from_plain(Claims, json.loads(one), f"{path}:{at}") for at, one in enumerate(text, start=1)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace the cases that have no line yet, and print the table of all."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.false_claims")
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=ROWS, help="rows; all of them by default")
    parser.add_argument("--count", type=int, default=51, help="cases of each row; 51 by default")
    parser.add_argument("--workers", type=int, default=1, help="processes; 1 by default")
    parser.add_argument("--out", type=Path, required=True, help="file of the lines")
    options = parser.parse_args(arguments)
    there = {(one.row, one.seed, one.number) for one in read_lines(options.out)}
    every = [Asked(options.seed, row, number) for number in range(options.count) for row in options.rows]
    todo = [one for one in every if (one.row, one.seed, one.number) not in there]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(claims_of, one) for one in todo]
        for future in track(as_completed(futures), total=len(futures), description="cases"):
            with options.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(future.result())) + "\n")
    print("\n".join(table([one for one in read_lines(options.out) if one.row in options.rows])))  # noqa: T201


if __name__ == "__main__":
    main()
