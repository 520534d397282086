"""numba's cache on disk: compiled code is not used again once any file that it comes from has changed."""

import subprocess
import sys
from pathlib import Path

from fem_models.chain import compiled, equations, follow, laws, newton, parameters
from fem_models.compiled import checksum_of
from fem_models.load import stepping
from fem_models.solid import superelastic_kernel

CHAIN = (equations, follow, laws, newton)
KERNEL = """
from pathlib import Path
import point
from fem_models.compiled import njit_of

@njit_of(Path(point.__file__))()
def twice(p):
    return 2.0 * p.x

assert twice(point.TYPE(1.5)) == 3.0
print(sum(twice.stats.cache_hits.values()))
"""
TYPE = "from typing import NamedTuple\nclass {name}(NamedTuple):\n    x: float\nTYPE = {name}\n"


def test_checksum_of_the_chain_is_of_all_files_that_its_kernels_come_from():
    named = {path.resolve() for path in compiled.SOURCES}
    for module in (*CHAIN, parameters, stepping):
        assert Path(module.__file__).resolve() in named


def test_all_kernels_of_several_files_or_types_are_cached_by_checksum():
    sums = {module: checksum_of(compiled.SOURCES) for module in CHAIN}
    sums[superelastic_kernel] = checksum_of([Path(superelastic_kernel.__file__)])
    for module, checksum in sums.items():
        own = [one for one in vars(module).values() if getattr(one, "__module__", "") == module.__name__]
        kernels = [one for one in own if hasattr(one, "py_func")]
        assert len(kernels) > 1
        assert all(one._cache._cache_file._source_stamp == checksum for one in kernels)


def test_a_type_that_is_renamed_in_another_file_compiles_again(tmp_path):
    kernel = tmp_path / "kernel.py"  # which itself stays as it is
    kernel.write_text(KERNEL)

    def hits(name: str) -> int:
        (tmp_path / "point.py").write_text(TYPE.format(name=name))
        done = subprocess.run([sys.executable, "-B", kernel], check=True, capture_output=True, text=True)
        return int(done.stdout)

    assert [hits(name) for name in ("One", "One", "Two")] == [0, 1, 0]


CALLED = """
from pathlib import Path
from fem_models.compiled import njit_of

own_njit = njit_of(Path(__file__))

@own_njit(error_model="python")
def inverse(x):
    return 1.0 / x

@own_njit()
def summed(values):
    total = 0.0
    for value in values:
        total += inverse(value)
    return total

try:
    summed((1.0, 0.0))
except ZeroDivisionError:
    print(summed((1.0, 2.0)), len(summed.overloads), len(inverse.overloads), inverse(4.0), len(inverse.overloads))
"""


def test_a_kernel_that_another_calls_has_no_machine_code_until_python_calls_it(tmp_path):
    kernel = tmp_path / "kernel.py"
    kernel.write_text(CALLED)
    for _ in range(2):  # compiled, then from the cache
        done = subprocess.run([sys.executable, "-B", kernel], check=True, capture_output=True, text=True)
        assert done.stdout.split() == ["1.5", "1", "0", "0.25", "1"]
