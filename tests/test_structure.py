"""The structure of the code keeps its bounds; ``python tests/structure.py`` prints what breaks one."""

import pytest
import structure


@pytest.mark.parametrize("rule", structure.RULES)
def test_structure(rule):
    measure, most = structure.RULES[rule]
    found = measure()
    assert len(found) <= most, f"{rule}: " + ", ".join(map(str, found))
