"""numba's cache on disk: compiled code is not taken up again when any file that it comes from has changed."""

import subprocess
import sys
from pathlib import Path

from fem_models.chain import compiled, equations, follow, laws, newton
from fem_models.load import stepping

KERNEL = """
import sys
from fem_models.chain import compiled
compiled.CHECKSUM = sys.argv[1]

@compiled.chain_njit()
def twice(x: float) -> float:
    return 2.0 * x

assert twice(1.5) == 3.0
print(sum(twice.stats.cache_hits.values()))
"""


def test_checksum_is_of_all_files_that_kernels_come_from():
    named = {path.resolve() for path in compiled.sources()}
    for module in (equations, follow, laws, newton, stepping):
        assert Path(module.__file__).resolve() in named
    kernels = [one for module in (equations, follow, laws, newton) for one in vars(module).values()]
    own = [one for one in kernels if hasattr(one, "py_func")]
    assert len(own) > 20
    assert all(compiled.CHECKSUM in one._cache._impl.filename_base for one in own)


def test_code_of_other_sources_is_compiled_again(tmp_path):
    kernel = tmp_path / "kernel.py"  # which itself stays as it is
    kernel.write_text(KERNEL)

    def hits(checksum: str) -> int:
        done = subprocess.run([sys.executable, kernel, checksum], check=True, capture_output=True, text=True)
        return int(done.stdout)

    assert [hits(checksum) for checksum in ("one", "one", "two")] == [0, 1, 0]
