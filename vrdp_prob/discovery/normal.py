"""Quantiles of the standard normal distribution, as intervals and bounds need them."""

WITHIN_95, WITHIN_90, WITHIN_50 = 1.959964, 1.644854, 0.674490
"""Standard deviations on either side of the middle that hold 95, 90 and 50 %."""
BELOW_95 = WITHIN_90
"""Standard deviations above the middle below which 95 % lie."""
