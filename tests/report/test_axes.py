"""Axes of the figures: what they hold, and where values stand on them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.inference.draws.summaries import Summary
from vrdp_prob.report.axes import linear_axis, log_axis, size_axis, unit_axis


def test_log_axis_gives_equal_ratios_equal_lengths():
    axis = log_axis([Summary(1.0, 0.1, 0.25, 4.0)])
    assert axis.place(1.0) - axis.place(0.5) == pytest.approx(axis.place(2.0) - axis.place(1.0), abs=0.02)
    assert (axis.place(1e-9), axis.place(1e9)) == (0.0, 100.0)


def test_axes_hold_their_intervals():
    wide = Summary(20.0, 9.0, 0.02, 60.0)
    axis = log_axis([wide])
    assert 0 < axis.place(wide.q05) < axis.place(wide.q95) < 100
    assert unit_axis([Summary(1.1, 0.1, 0.9, 1.3)]).high == 1.3
    assert log_axis([]).ticks == (0.5, 1.0, 2.0)


@given(st.lists(st.floats(-1e6, 1e6).filter(lambda value: value == 0 or abs(value) > 1e-6), min_size=1))
def test_a_linear_axis_holds_all_values_and_0_between_few_ticks(values):
    axis = linear_axis(values)
    assert axis.low <= min(0, *values) <= max(0, *values) <= axis.high
    assert 2 <= len(axis.ticks) <= 7
    assert axis.low <= axis.ticks[0] <= axis.ticks[-1] <= axis.high
    assert 0 in axis.ticks


def test_ticks_are_round():
    assert linear_axis([12.3, 4.1]).ticks == (0, 5, 10)
    assert linear_axis([-3.0, 41.0]).ticks == (0, 10, 20, 30, 40)
    assert linear_axis([-3.0, -1.0]).high == 0


def test_sizes_start_at_0_unless_they_are_far_apart():
    assert size_axis([3.0, 12.3]).low == 0
    far = size_axis([0.015, 30.0])
    assert far.logarithmic
    assert far.ticks == (0.01, 0.1, 1.0, 10.0, 100.0)
    assert size_axis([1e-9, 1.0, 0.0]).ticks == (1e-9, 1e-6, 1e-3, 1.0)
    assert size_axis([0.0]).ticks == (-1.0, 0.0, 1.0)
