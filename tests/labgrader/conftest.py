"""What tests of grading share."""

from contextlib import nullcontext

import pytest

from labgrader.grade import batch
from labgrader.grade.diagnose_outputs import diagnosers
from labgrader.sandbox import sandbox


@pytest.fixture(scope="module", autouse=True)
def servers_that_stay(request):
    """What one run of grading starts serves the file's others, which would wait a second each; the sandbox's own tests,
    and commands in processes of their own, end it as a run does.
    """
    if request.path.parent.name == "sandbox":
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batch, "closing", nullcontext)
        yield
    sandbox.servers.close()
    diagnosers.close()
