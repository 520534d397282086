"""Whether a script may start worker processes: they run it again, up to the line that keeps the main process's part."""

from __future__ import annotations

import ast
import multiprocessing
import sys
from pathlib import Path

from studies.sweep.errors import StudyError

GUARD = 'if __name__ == "__main__":'


def require_guarded_script() -> None:
    """Refuse to start workers from a plain script, which each of them would run again, and start workers in turn.

    Raises
    ------
    StudyError
        One line with the script, the line of the call, and the guard that it must stand below.
    """
    main = sys.modules["__main__"]
    file = getattr(main, "__file__", None)
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # a worker that runs the script of its parent
        raise StudyError(_message(file or "the script"))
    if file is None:  # a notebook, or a prompt
        return
    line = _line_in(vars(main), file)
    if line is not None and not _is_guarded(Path(file), line):
        raise StudyError(_message(f"{file}:{line}"))


def _message(where: str) -> str:
    return f"{where}: nb.study starts processes that run this script again: expected the call below `{GUARD}`"


def _line_in(names: dict[str, object], file: str) -> int | None:
    """Line of the main module's file that is being run; None where another thread runs it, or nothing."""
    frame = sys._getframe()
    while frame is not None:
        code = frame.f_code
        if frame.f_globals is names and code.co_name == "<module>" and code.co_filename == file:  # text may run text
            return frame.f_lineno
        frame = frame.f_back  # type: ignore[assignment]
    return None


def _is_guarded(file: Path, line: int) -> bool:
    """Whether a line stands below the guard; also where the source cannot be read."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return True
    guards = [node for node in tree.body if isinstance(node, ast.If) and "__main__" in ast.unparse(node.test)]
    return any(guard.body[0].lineno <= line <= (guard.body[-1].end_lineno or line) for guard in guards)
