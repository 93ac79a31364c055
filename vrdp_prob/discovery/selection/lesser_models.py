"""A model without some of its causes, as it would have been found without them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.selection.gains import gain, merit
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.second_look import doubtful
from vrdp_prob.models.effects.effect import Effect

PLAIN = 50.0
"""Gain of a cause, in those that are needed, from which it is not put in doubt again."""


@dataclass(frozen=True)
class LesserModels:
    """Models without some of their causes.

    Parameters
    ----------
    refits
        What every model leaves, and the refits of it.
    """

    refits: Refits

    def left_out(self, best: Trial, divisor: Float[np.ndarray, "video"], *causes: Effect) -> Trial:
        """A model without some of its causes, searched the longer the less these seem to bring.

        What a cause brings that may as well vanish are courses of events, which the model without it may find, too.
        """

        def takes_a_search(lesser: Trial) -> bool:
            little = gain(best, lesser)[0] < PLAIN * self.refits.needed
            return little or self.refits.is_nothing(best, lesser, divisor)

        found = best.without(*causes)
        if takes_a_search(found):
            found = found.mended(doubtful(found.fit.fits), seed=self.refits.seed)
        return found.continued() if takes_a_search(found) else found

    def without_each(
        self, best: Trial, causes: Sequence[Effect], divisor: Float[np.ndarray, "video"]
    ) -> tuple[Trial, ...]:
        """A model without each of some causes."""
        return tuple(self.left_out(best, divisor, cause) for cause in causes)

    def established(self, best: Trial) -> tuple[Trial, tuple[Trial, ...]]:
        """A model without those of its causes that bring too little, and the same without each of the others."""
        divisor = self.refits.leavings.of(best).overdispersion
        return self.pruned(best, self.without_each(best, best.causes, divisor), divisor)

    def pruned(
        self, best: Trial, lesser: tuple[Trial, ...], divisor: Float[np.ndarray, "video"]
    ) -> tuple[Trial, tuple[Trial, ...]]:
        """The same of a model of which those without each of its causes are known."""
        while (left := self._without_doubted(best, lesser, divisor)) is not None:
            best, lesser = left, self.without_each(left, left.causes, divisor)
        return best, lesser

    def _without_doubted(
        self, best: Trial, lesser: Sequence[Trial], divisor: Float[np.ndarray, "video"]
    ) -> Trial | None:
        """A model without the weakest of its causes that are not established; None where all are."""
        weakest_first = sorted(lesser, key=partial(merit, overdispersion=divisor), reverse=True)
        return next((one for one in weakest_first if self.refits.doubted(best, one, divisor)), None)

    def unpatched(self, best: Trial) -> Trial:
        """A model without those of its causes that patch several videos and explain few of them."""
        while (patching := next((cause for cause in best.causes if best.patches(cause)), None)) is not None:
            best = self.left_out(best, self.refits.leavings.of(best).overdispersion, patching)
        return best
