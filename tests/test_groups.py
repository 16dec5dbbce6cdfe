"""What is costly to set up is set up once: tests of a group run in one process."""

import pytest


@pytest.mark.xdist_group("groups")
def test_tests_of_a_group_stay_together(request):
    if request.config.getoption("dist") == "loadgroup":
        # By this the distribution knows them.
        assert request.node.nodeid.endswith("@groups")
