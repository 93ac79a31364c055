"""`python -m vrdp_prob` is the command `vrdp-prob`."""

from vrdp_prob.cli import main

main()
