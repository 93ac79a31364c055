"""Report content made by hand, with and without a camera."""

import pytest
from example_content import make_content

from vrdp_prob.report import ReportContent
from vrdp_prob.scene import Camera


@pytest.fixture(scope="session")
def content() -> ReportContent:
    """Content of a video seen by a camera."""
    return make_content(camera=Camera.clevrer())


@pytest.fixture(scope="session")
def plain_content() -> ReportContent:
    """Content of tracks without a camera."""
    return make_content(draws=8)
