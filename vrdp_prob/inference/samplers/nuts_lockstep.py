"""Several samplers, each written as if it were alone, whose gradients are computed in one batch.

A gradient of one world costs as much as those of ten in a batch, and Pyro's NUTS asks for one at a time. Every chain
has a thread of its own, of which only one runs at any time: up to its next request, in turn. So torch's random numbers
can be those of the chain, and the same seeds give the same draws.
"""

from collections.abc import Callable, Sequence
from threading import Semaphore, Thread
from typing import Generic, TypeVar

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

Result = TypeVar("Result")
DensityAndGradient = Callable[
    [Float[np.ndarray, "chain dimension"]],
    tuple[Float[np.ndarray, "chain"], Float[np.ndarray, "chain dimension"]],
]
Ask = Callable[[Float[np.ndarray, "dimension"]], tuple[float, Float[np.ndarray, "dimension"]]]
"""Log density and gradient at one place."""


class _ClosedError(Exception):
    """Nobody waits for the result any more."""


class _Chain(Generic[Result]):
    """A function that runs while it is given its turn."""

    def __init__(self, function: Callable[[Ask], Result], seed: int) -> None:
        self._function = function
        self._turn, self._over = Semaphore(0), Semaphore(0)
        self._random: Tensor = torch.Generator().manual_seed(seed).get_state()
        self._closed = False
        self._error: Exception | None = None
        self._result: list[Result] = []
        self.running = True
        self.place: Float[np.ndarray, "dimension"] = np.empty(0)
        self.answer: tuple[float, Float[np.ndarray, "dimension"]] = (0.0, self.place)
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def result(self) -> Result:
        """What the function gave."""
        return self._result[0]

    def resume(self) -> None:
        """Let it run up to its next request, or its end."""
        self._turn.release()
        self._over.acquire()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End it wherever it is."""
        if self.running:
            self._closed = True
            self._turn.release()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._wait()
            self._result.append(self._function(self._ask))
        except _ClosedError:
            pass
        except Exception as error:  # raised again where it is waited for
            self._error = error
        finally:
            self.running = False
            self._over.release()

    def _ask(self, place: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"]]:
        self.place = place
        self._random = torch.get_rng_state()
        self._over.release()
        self._wait()
        return self.answer

    def _wait(self) -> None:
        self._turn.acquire()
        if self._closed:
            raise _ClosedError
        torch.set_rng_state(self._random)


def in_lockstep(
    functions: Sequence[Callable[[Ask], Result]], seeds: Sequence[int], density_and_gradient: DensityAndGradient
) -> list[Result]:
    """What each of some functions gives, each with a seed for torch's random numbers.

    Parameters
    ----------
    functions
        Each is given a function to ask for a log density and its gradient.
    seeds
        One for each.
    density_and_gradient
        Answers what all that still run have asked for.
    """
    with torch.random.fork_rng(devices=[]):
        chains = [_Chain(function, seed) for function, seed in zip(functions, seeds, strict=True)]
        try:
            for chain in chains:
                chain.resume()
            while asking := [chain for chain in chains if chain.running]:
                values, gradients = density_and_gradient(np.stack([chain.place for chain in asking]))
                for chain, value, gradient in zip(asking, values, gradients, strict=True):
                    chain.answer = (float(value), gradient)
                    chain.resume()
        finally:
            for chain in chains:
                chain.close()
    return [chain.result for chain in chains]
