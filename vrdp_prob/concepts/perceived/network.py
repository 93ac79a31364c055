"""All that is learned: encoders and concept spaces, and a video as they see it."""

from collections.abc import Mapping, Sequence

import torch
from jaxtyping import Float
from torch import Tensor, nn

from vrdp_prob.concepts.perceived.crop_statistics import STATISTICS
from vrdp_prob.concepts.perceived.embeddings import ConceptSpace
from vrdp_prob.concepts.perceived.encoder import APPEARANCE, AppearanceEncoder, WindowEncoder
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.slides import SLIDE_STATISTICS
from vrdp_prob.concepts.perceived.soft_facts import SoftEvents, SoftFacts, SoftMotion
from vrdp_prob.concepts.perceived.trajectories import COORDINATES, WINDOW, window_of_frame, windows_in_sight
from vrdp_prob.concepts.perceived.vocabulary import EVENTS, MOTIONS, Vocabulary

_RARE = 0.3
"""First mu of events: windows in which nothing happens are the rule."""

Attributes = Mapping[str, Float[Tensor, "object value"]]


class ConceptNetwork(nn.Module):
    """Encoders and concept spaces.

    Parameters
    ----------
    vocabulary
        The attribute words to learn.
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        super().__init__()
        self.vocabulary = vocabulary
        self.appearance = AppearanceEncoder(STATISTICS, SLIDE_STATISTICS)
        self.attributes = nn.ModuleDict(
            {name: ConceptSpace(words, APPEARANCE) for name, words in vocabulary.values.items()}
        )
        self.motion_encoder = WindowEncoder(COORDINATES * WINDOW)
        self.crossing_encoder = WindowEncoder(COORDINATES * WINDOW)
        self.pair_encoder = WindowEncoder(3 * COORDINATES * WINDOW)
        self.motions = ConceptSpace(MOTIONS, WindowEncoder.length)
        self.crossings = ConceptSpace(EVENTS[1:], WindowEncoder.length, mu=_RARE)
        self.meetings = ConceptSpace(EVENTS[:1], WindowEncoder.length, mu=_RARE)

    @property
    def device(self) -> torch.device:
        """Where it computes."""
        return self.appearance.mean.device

    def measure(self, observations: Sequence[Observation]) -> None:
        """Take means and scales of what the encoders see from the videos to learn from."""
        self.appearance.mean.copy_(torch.cat([one.statistics for one in observations]).mean(dim=0))
        self.motion_encoder.measure(torch.cat([one.windows[windows_in_sight(one.sight)] for one in observations]))
        self.crossing_encoder.measure(torch.cat([one.windows.flatten(end_dim=1) for one in observations]))
        self.pair_encoder.measure(
            torch.cat([one.pair_windows[:, one.pairs_in_sight].flatten(0, 1) for one in observations])
        )

    def attributes_of(
        self, observations: Sequence[Observation], statistics: Sequence[Float[Tensor, "crop statistic"]] | None = None
    ) -> list[Attributes]:
        """Probability of each value of each attribute, for the objects of several videos.

        Parameters
        ----------
        observations
            The videos.
        statistics
            Statistics of their crops instead of the observed ones: of the same crops in another light.
        """
        shown = [one.statistics for one in observations] if statistics is None else statistics
        most = max(one.there.shape[1] for one in observations)
        there = torch.cat([nn.functional.pad(one.there, (0, most - one.there.shape[1])) for one in observations])
        slides = torch.cat([one.slides for one in observations])
        inputs = (torch.cat(list(shown)), there, slides)
        features = self.appearance(*(values.to(self.device) for values in inputs))
        owner = torch.cat([torch.full((len(one.there),), place) for place, one in enumerate(observations)])
        table = {name: self._space(name).exclusive(features).cpu() for name in self.attributes}
        return [{name: values[owner == place] for name, values in table.items()} for place in range(len(observations))]

    def motion_of(self, observation: Observation) -> SoftMotion:
        """Who moves when, by the concepts; who is in sight is seen."""
        probability = self.motions.exclusive(self.motion_encoder(self._windows(observation.windows)))[..., 0].cpu()
        here = observation.sight.double()
        return SoftMotion(observation.times.numpy(), here, here * probability[window_of_frame(len(observation.times))])

    def events_of(self, observation: Observation) -> SoftEvents:
        """What happens, by the concepts: an event is as probable as its best window, which is also its time."""
        pairs = self._windows(observation.pair_windows)
        meeting = self.meetings.scores(self.pair_encoder(pairs))[..., 0].mean(dim=0).cpu()
        meeting = meeting.masked_fill(~observation.pairs_in_sight, -torch.inf)
        crossing = self.crossings.scores(self.crossing_encoder(self._windows(observation.windows))).cpu()
        score, window = torch.cat([meeting, crossing[..., 0], crossing[..., 1]], dim=1).max(dim=0)
        time = observation.times[window + WINDOW // 2]
        ends = observation.times[[0, -1]]
        happens = torch.cat([torch.sigmoid(score).double(), torch.ones(2, dtype=torch.double)])
        return SoftEvents(observation.universe, happens, torch.cat([time, ends]))

    def facts(self, observation: Observation, attributes: Attributes, *, learned_events: bool) -> SoftFacts:
        """A video as these concepts see it; its events and motion by the concepts, or by the tracks."""
        if learned_events:
            events, motion = self.events_of(observation), self.motion_of(observation)
        else:
            events, motion = observation.events, observation.motion
        return SoftFacts(attributes, self.vocabulary.values, events, motion)

    def _space(self, attribute: str) -> ConceptSpace:
        space = self.attributes[attribute]
        assert isinstance(space, ConceptSpace)
        return space

    def _windows(self, windows: Tensor) -> Tensor:
        return windows.to(self.device)
