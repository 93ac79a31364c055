"""A model that is tried on all videos: its fit, and how well it predicts each video from the others."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.candidates.kicked_at_contact import kicked_at_contact
from vrdp_prob.discovery.candidates.scores import happens_once, mends_any_course
from vrdp_prob.discovery.finding import HeldOut
from vrdp_prob.discovery.residuals.held_out import Cavity, cavities
from vrdp_prob.discovery.residuals.jitter import alike_in_neighbours
from vrdp_prob.discovery.residuals.unexplained import Unexplained, unexplained
from vrdp_prob.discovery.selection.estimates import may_vanish
from vrdp_prob.discovery.selection.forecast import held_out
from vrdp_prob.inference.several_videos.ascent import Effort
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.population import own_parameters, with_learned_population
from vrdp_prob.inference.several_videos.second_look import (
    LOST,
    explained,
    lost_videos,
    may_take_another_course,
    most_astray,
    most_lost,
)
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Parameter, Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.unknowns import NOISE, Held, Owned

EACH_PARAMETER = 1.0
"""Nats by which a cause is believed less for each of its parameters.

A cause that holds another one as its limit (a bowl whose middle is far away is a slope) predicts as well as that one.
"""
FIRST = Effort(rounds=5, enough=2.0)
"""With what effort it is seen whether a cause can win."""
OTHER_SPREAD = 1.25
"""Factor by which bodies must differ more or less under a model than was believed, for the belief to be changed..."""
OTHER_MIDDLE = 0.25
"""...or by which share of it their middle must be elsewhere..."""
SPREAD_ROUNDS = 3
"""...and how often, since what bodies differ by hangs on what is believed of it."""
PATCHED = 0.5
"""Share of the videos with a cause that happens once from which on, if they stray still or it comes with a contact, it
explains none of them."""
ALIKE_BY_CHANCE = 1e-3
"""Probability that lateness of neighbouring frames is so much alike by chance, below which it is none."""
FELL = 5.0
"""Nats by which a video may be less probable with one more cause; beyond that it has lost its course of events."""
HELD_BACK = 1.0
"""The same for a video that may hold a cause back whose common climb ended before it was at the top."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A base model with some causes, fitted to all videos.

    Parameters
    ----------
    causes
        What it has beyond the base model, in the order in which it was found.
    fit
        Its fit.
    choices
        By the name of a cause: logarithm of the number of places among which its own were chosen, for each video.
    stated
        What the base model believed of parameters, by name, before anything was learned.
    """

    causes: tuple[Effect, ...]
    fit: SharedFit
    choices: Mapping[str, Float[np.ndarray, "video"]] = field(default_factory=dict)
    stated: Mapping[str, Parameter] = field(default_factory=dict)

    def of_some(self, chosen: Sequence[int]) -> "Trial":
        """The model fitted to some of its videos alone, which believes of bodies what all say."""
        choices = {name: one[list(chosen)] for name, one in self.choices.items()}
        return replace(self, fit=self.fit.of_some(chosen), choices=choices)

    @cached_property
    def cavities(self) -> dict[str, Cavity]:
        """What all videos but one say, and how probable that one is then."""
        return cavities(self.fit)

    @cached_property
    def held_out(self) -> HeldOut:
        """How far off its predictions are, each video's from the others and its own first part."""
        joint = self.fit.joint
        points = [joint.point(index) for index in range(len(joint.videos))]
        return held_out(joint.videos, points, list(self.cavities.values()))

    @cached_property
    def unexplained(self) -> Unexplained:
        """What it leaves to chance."""
        return unexplained(self.fit)

    @property
    def log_density(self) -> Float[np.ndarray, "video"]:
        """Log predictive density (nats, up to constants of the tracks) of each video given the others.

        What it leaves unexplained is chance as it is most probable. An effect that happens once may have happened to
        any body of any video, and between any two frames where that is all that is known of its time, which counts
        against it.
        """
        return self.fitted_density + self.unexplained.gains

    @property
    def fitted_density(self) -> Float[np.ndarray, "video"]:
        """The same where all that it leaves unexplained is noise."""
        density = np.array([one.log_density for one in self.cavities.values()])
        return density - sum(self.choices.values(), np.zeros(len(density)))

    def brought(self, base: "Trial") -> float:
        """Gain (nats) over a model with less where all that both leave unexplained is noise.

        A fit is judged by this: what it has lost, chance would cover.
        """
        return float((self.fitted_density - base.fitted_density).sum())

    @property
    def lacking(self) -> float:
        """What a model would bring (nats) that explains all lost videos, where all that this one leaves is noise."""
        lost = [self.fit.fits[index] for index in lost_videos(self.fit.fits)]
        return sum(2.0 * float(one.clues.tracks.seen.sum()) * math.log(one.misfit.ratio) for one in lost)

    @property
    def noise(self) -> float:
        """Scale of the noise that all videos share; 1 where they share none."""
        shared = self.fit.value(NOISE)
        return 1.0 if shared is None else shared

    @property
    def log_prior(self) -> float:
        """Log prior (nats, up to a constant) of its causes among others: those with fewer parameters come first."""
        return -EACH_PARAMETER * sum(len(cause.parameters) for cause in self.causes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the causes."""
        return tuple(cause.name for cause in self.causes)

    @property
    def cause_names(self) -> frozenset[str]:
        """Names of the causes, of which several may be ways or things of one."""
        return frozenset(cause.cause_name() for cause in self.causes)

    def beyond(self, base: "Trial") -> tuple[Effect, ...]:
        """The causes that it has beyond those of another model."""
        return tuple(cause for cause in self.causes if cause not in base.causes)

    def may_vanish(self, cause: Effect, overdispersion: Float[np.ndarray, "video"]) -> bool:
        """Whether the strength of a cause may as well be nothing, see `estimates.may_vanish`."""
        return may_vanish(self.fit, cause, unexplained=self.unexplained, overdispersion=overdispersion)

    def with_cause(self, guess: FirstGuess) -> "Trial | None":
        """The fit with one more cause, from a first guess of it; None where no world can begin there."""
        try:
            return self._with_single_events(guess) if happens_once(guess.effect) else self._with_lasting(guess)
        except ImpossibleStartError:
            return None

    def fallen_from(self, base: "Trial") -> list[int]:
        """Videos that are less probable than under a model with less, the worst first: they have lost their course."""
        fallen = self._fallen_from(base)
        return fallen[: max(most_astray(len(self.fit.fits)), 1)]

    def loses_videos_of(self, other: "Trial") -> bool:
        """Whether a video is less probable than in another fit and explained no more."""
        return any(self.fit.fits[index].misfit.ratio > LOST for index in self._fallen_from(other))

    def loses_most_of(self, other: "Trial") -> bool:
        """Whether most videos are explained no more, which they are in another fit."""
        return explained(other.fit.fits) and not explained(self.fit.fits)

    def _fallen_from(self, base: "Trial", by: float = FELL) -> list[int]:
        gained = self.fitted_density - base.fitted_density
        return [int(k) for k in np.argsort(gained) if gained[k] < -by]

    def freed(self, base: "Trial", *, seed: int) -> "Trial":
        """The fit with videos searched anew that may hold back what it has beyond a model with less; the better one.

        On a wrong course of events a video may be explained as well, and have no world where a cause grows to what the
        others ask for: then the common climb ends there. Where more videos lose than may be on wrong courses by
        themselves, or most are not explained, the model lacks something else.
        """
        fits = self.fit.fits
        if self.fit.joint.converged or not explained(fits):
            return self
        holding = [one for one in self._fallen_from(base, HELD_BACK) if may_take_another_course(fits[one])]
        found = self if len(holding) > most_lost(len(fits)) else self.mended(holding, seed=seed, yielding=True)
        if found is self:
            return self
        found = replace(found, fit=with_own_population(found.fit)).continued()
        return found if found.brought(base) > self.brought(base) else self

    def with_cause_in_place(self, guess: FirstGuess, replaced: Effect, least: float) -> "Trial | None":
        """The fit with a cause in the place of another one, from where that has brought the videos.

        None where no world can begin there, or the log posterior is not above `least` at once.
        """
        left = self.fit.model.without_effect(replaced).with_effect(guess.effect, self.fit.tracks)
        choices = {name: one for name, one in self.choices.items() if name != replaced.name}
        try:
            fit = with_own_population(
                self.fit.under(
                    left,
                    start=guess.start,
                    held=self._held_without(replaced),
                    least=least,
                    effort=FIRST,
                    model_error=False,
                )
            )
        except ImpossibleStartError:
            return None
        kept = (one for one in self.causes if one is not replaced)
        return replace(self, causes=(*kept, guess.effect), fit=fit, choices=choices)

    def begun_elsewhere(self, base: "Trial", guess: FirstGuess) -> "Trial":
        """The most probable of the fit and those that begin at other sizes of its last cause, from a model without it.

        One size explains as much as another where few bodies meet what has it; how many values of it do is what tells
        between them.
        """
        begun = (base.with_cause(replace(guess, start=start)) for start in guess.other_starts)
        return max([self, *(one.continued() for one in begun if one is not None)], key=lambda one: one.fit.log_evidence)

    def start_with(self, cause: Effect) -> FirstGuess:
        """A start of refits with one of its causes, which all videos share, as it is here."""
        values = {one.name: self.fit.value(one.name) for one in cause.parameters}
        start = {name: value for name, value in values.items() if value is not None}
        return FirstGuess(cause, start)

    def _with_lasting(self, guess: FirstGuess) -> "Trial":
        """The fit with an effect that acts on all videos."""
        effect = guess.effect
        own_fields = [one.name for one in effect.parameters if one.scope is Scope.BODY]
        bodies = [range(len(part.likelihood.tracks.bodies)) for part in self.fit.fits]
        starts: list[dict[Owned, float]] = [
            {(name, body): guess.start[name] for name in own_fields if name in guess.start for body in these}
            for these in bodies
        ]
        model = self.fit.extended(effect)
        fit = self.fit.under(model, start=guess.start, own=starts, effort=FIRST, model_error=False)
        return self.and_causes([effect], fit)

    def and_causes(self, effects: Sequence[Effect], fit: SharedFit) -> "Trial":
        """The trial of a fit with further causes, which believes what that fit says of bodies."""
        return replace(self, causes=(*self.causes, *effects), fit=with_own_population(fit))

    def _with_single_events(self, guess: FirstGuess) -> "Trial":
        """The fit with an effect that happens at most once in each video, where its scan has found it."""
        effect = guess.effect
        sites = [[site for site in guess.sites if site.video == k] for k in range(len(self.fit.fits))]
        fields = [parameter.name for parameter in effect.parameters]
        held, own = [], []
        for part, structure, mine in zip(self.fit.fits, self.fit.structures, sites, strict=True):
            owners = (None, *range(len(part.likelihood.tracks.bodies)))
            values: dict[Owned, float] = {}
            for site in mine[:1]:
                values |= {
                    (name, owner): effect.vanishes_at.get(name, value)
                    for name, value in site.values.items()
                    for owner in (site.owner, None)
                }
            absent = {(name, owner): None for name in fields for owner in owners if (name, owner) not in values}
            steps = {key: value for key, value in values.items() if key[0] in effect.stepwise}
            held.append({**structure.held, **absent, **steps})
            own.append(values)
        acting = np.array([min(len(mine), 1) for mine in sites])
        times = [len(effect.search_points([one])) if effect.stepwise else 1 for one in self.fit.tracks]
        places = np.maximum(
            max(guess.places, 1) * np.array(times), 2
        )  # where there is but one, it acts there or nowhere
        choices = {**self.choices, effect.name: np.log(places) * acting}
        model = self.fit.extended(effect)
        fit = self.fit.under(model, own=own, held=held, effort=FIRST, model_error=False)
        return replace(self, causes=(*self.causes, effect), fit=fit, choices=choices)

    def continued(self) -> "Trial":
        """The fit after as many steps as it needs."""
        if self.fit.joint.converged:
            return self
        return replace(self, fit=self.fit.under(self.fit.model, model_error=False))

    def acting(self, cause: Effect) -> list[int]:
        """Videos on which a cause acts that happens once."""
        return [int(video) for video in np.flatnonzero(self.choices[cause.name])]

    def turns(self, cause: Effect) -> int:
        """How often bodies are turned by a cause that kicks them once, or that puts something in their way."""
        if happens_once(cause):
            return len(self.acting(cause))
        restitutions = self.fit.model.obstacle_restitutions
        its_own = [restitutions.index(name) for name in cause.obstacle_restitutions]
        met = [part.rollout.events.of_kind(RolloutEventKind.OBSTACLE).second for part in self.fit.fits]
        return sum(int(np.isin(some, its_own).sum()) for some in met)

    def patches(self, cause: Effect) -> bool:
        """Whether a cause mends the fit of videos and explains none of them.

        One kick explains a video or it does not. Where nearly every video needs one and strays with it as well, kicks
        stand for something that acts all the time; where they come with contacts, for errors of these. Frames that are
        late as their neighbours are stand for motion along the paths.
        """
        if cause.overrides("frame_jitter"):
            return alike_in_neighbours(self.fit) < ALIKE_BY_CHANCE
        if not happens_once(cause):
            return False
        acting = self.acting(cause)
        at_contacts = sum(self._comes_with_contact(cause, video) for video in acting)
        if acting and at_contacts >= PATCHED * len(acting):
            return True
        stray = set(self.unexplained.videos) & set(acting)
        return len(acting) > 1 and len(stray) > PATCHED * len(acting)

    def _comes_with_contact(self, cause: Effect, video: int) -> bool:
        """Whether a body meets something when a cause kicks it."""
        part = self.fit.fits[video]
        own = {one.name for one in cause.parameters if one.scope is Scope.BODY}
        entries = part.likelihood.coordinates.entries
        kicked = [entry.owner for entry in entries if entry.field in own and entry.owner is not None]
        return kicked_at_contact(part.rollout.events, part.likelihood.tracks.times, kicked)

    def mended(self, lost: Sequence[int], *, seed: int, thorough: bool = False, yielding: bool = False) -> "Trial":
        """The fit with some videos searched anew; itself where that finds nothing better, or with kicks.

        These are found on the courses that there are.
        """
        if any(mends_any_course(cause) for cause in self.causes):
            return self
        fit = self.fit.mended(lost, seed=seed, thorough=thorough, yielding=yielding)
        return self if fit is self.fit else replace(self, fit=fit)

    def with_courses_of(self, other: "Trial") -> "Trial":
        """The fit with what happens in another one, of the same causes, in videos that are more probable there.

        Where not all of them can follow, with that in the one that is most so.
        """
        fallen = self._fallen_from(other)
        for chosen in (fallen, fallen[:1]):
            fit = self.fit.with_courses_of(other.fit, chosen) if chosen else self.fit
            if fit is not self.fit:
                return replace(self, fit=fit)
        return self

    def with_other_courses(self, among: Collection[int], *, seed: int) -> "Trial":
        """The fit with some videos searched anew; itself where that finds nothing much better, or with kicks."""
        if any(mends_any_course(cause) for cause in self.causes):
            return self
        fit = self.fit.with_other_courses(seed=seed, among=among)
        return self if fit is self.fit else replace(self, fit=fit)

    def without(self, *causes: Effect) -> "Trial":
        """The fit without some of its causes, to which the videos' own numbers follow before those that they share.

        Without a law that all follow, nothing that they share can be read from where they are. Where no world can begin
        there the model is fitted from the beginning.
        """
        model, gone = self.fit.model, {cause.name for cause in causes}
        for cause in causes:
            model = model.without_effect(cause)
        left = self.with_stated_population(model)
        choices = {name: one for name, one in self.choices.items() if name not in gone}
        held = self._held_without(*causes)
        try:
            fit = self.fit.under(left, held=held, least=-math.inf, effort=FIRST, model_error=False)
        except ImpossibleStartError:
            if choices:  # a fit from the beginning knows of no single events
                raise
            fit = fit_together(self.fit.tracks, model=left, shared=self.fit.shared, model_error=False)
        kept = tuple(one for one in self.causes if one.name not in gone)
        return replace(self, causes=kept, fit=with_own_population(fit), choices=choices)

    def _held_without(self, *causes: Effect) -> list[Held]:
        """Numbers of each video that are held, but those of some causes."""
        gone = {parameter.name for cause in causes for parameter in cause.parameters}
        return [{key: one.held[key] for key in one.held if key[0] not in gone} for one in self.fit.structures]

    def with_stated_population(self, model: PhysicsModel) -> PhysicsModel:
        """A model in which bodies may be what they may before anything is learned.

        What a cause has explained, they have to explain by themselves without it, and would lose their way to it; and
        what a fit that explains no video has taught of them misleads the next one.
        """
        own = {one.name for one in own_parameters(model)}
        learned = {name: one for name, one in model.beliefs.items() if name not in own}
        return replace(model, beliefs=learned | {name: one for name, one in self.stated.items() if name in own})


def with_own_population(fit: SharedFit) -> SharedFit:
    """A fit that believes bodies to be in their own parameters as they are under its very model.

    What a model lacks shows as differences between them, and a cause that explains these away is worth that they are
    less. And no cause is worth that it shifts all restitutions to where they are believed to be.
    """
    for number in range(SPREAD_ROUNDS):
        model = with_learned_population(fit)
        if not _believes_otherwise(model, fit.model):
            break
        other = fit.under(model, effort=FIRST, model_error=False)
        if number and other.joint.log_evidence < fit.joint.log_evidence:
            break
        fit = other
    return fit


def _believes_otherwise(model: PhysicsModel, before: PhysicsModel) -> bool:
    """Whether a model believes something else of what bodies have of their own."""
    pairs = [(model.believed(one).prior, before.believed(one).prior) for one in own_parameters(model)]
    return any(
        abs(np.log(now.sd / then.sd)) > np.log(OTHER_SPREAD) or abs(now.mean - then.mean) > OTHER_MIDDLE * now.sd
        for now, then in pairs
    )
