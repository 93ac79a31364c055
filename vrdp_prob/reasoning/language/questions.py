"""Rules for whole questions."""

from collections.abc import Mapping

from vrdp_prob.reasoning.language.phrases import (
    COLLIDE,
    NounPhrase,
    Tokens,
    collision,
    condition,
    crossing,
    in_the_video,
    moment_or_ever,
    noun_phrase,
    plain_noun,
    the_event,
    the_object,
)
from vrdp_prob.reasoning.language.reader import NoReadingError, Reader
from vrdp_prob.reasoning.language.words import ATTRIBUTE_WORDS, COMPARATIVES, STATES

WHICH = ("what", "which event", "which events", "which of the following", "which of these")


def question_by_grammar(text: str, comparatives: Mapping[str, str] = COMPARATIVES) -> Tokens:
    """Program of a question in English.

    Parameters
    ----------
    text
        A question in CLEVRER's wording; case and punctuation do not matter.
    comparatives
        Words that say how an object would be changed, and their tokens.

    Raises
    ------
    InputError
        If it is empty.
    NotUnderstoodError
        If it is not understood; the message names the word.
    """
    reader = Reader(text, comparatives=comparatives)
    rules = (_counting, _existing, _doing, _attribute, _responsible, _next, _changed, _yes_no_prediction)
    return reader.whole(*(lambda rule=rule: rule(reader) for rule in rules))


def _counting(reader: Reader) -> Tokens:
    """'How many moving cubes are there when the video ends?'."""
    reader.expect("how many")
    return (*reader.first(lambda: _counted_collisions(reader), lambda: _counted_objects(reader)), "count")


def _counted_collisions(reader: Reader) -> Tokens:
    reader.expect("collisions")
    reader.expect("happen", "happened", "are there", "occur", "take place")
    return ("events", "objects", "filter_collision", *condition(reader))


def _counted_objects(reader: Reader) -> Tokens:
    phrase = noun_phrase(reader)
    if not phrase.plural or phrase.order:
        raise NoReadingError
    return reader.first(
        lambda: _with_state(reader, phrase),
        lambda: _there(reader, phrase),
        lambda: _acting(reader, phrase),
    )


def _there(reader: Reader, phrase: NounPhrase) -> Tokens:
    reader.expect("are there", "is there", "are")
    return _of_state(reader, phrase)


def _of_state(reader: Reader, phrase: NounPhrase) -> Tokens:
    if phrase.state is None:
        in_the_video(reader)
        return phrase.filters
    return (*phrase.filters, *moment_or_ever(reader), phrase.state)


def _with_state(reader: Reader, phrase: NounPhrase) -> Tokens:
    reader.expect("are", "is")
    return _stated_state(reader, phrase)


def _stated_state(reader: Reader, phrase: NounPhrase) -> Tokens:
    if phrase.state is not None:
        raise NoReadingError
    state = reader.one_of(STATES)
    return (*phrase.filters, *moment_or_ever(reader), state)


def _acting(reader: Reader, phrase: NounPhrase) -> Tokens:
    """Events: 'enter the scene before ...', 'collide with the cube after ...'."""
    if phrase.state is not None:
        raise NoReadingError
    if reader.accept(*COLLIDE):
        other = the_object(reader)
        return ("events", *other, "filter_collision", *phrase.filters, "filter_collision", *condition(reader))
    return ("events", *phrase.filters, crossing(reader), *condition(reader))


def _existing(reader: Reader) -> Tokens:
    """'Are there any cubes that enter the scene?', 'Is there a red sphere?'."""
    reader.expect("are there", "is there")
    reader.expect("any", "a", "an")
    if reader.accept("collisions", "collision"):
        reader.accept("that happen", "that happens", "happening")
        return ("events", "objects", "filter_collision", *condition(reader), "exist")
    phrase = noun_phrase(reader)
    if phrase.order:
        raise NoReadingError
    if reader.accept("that are", "that is"):
        return (*_stated_state(reader, phrase), "exist")
    if reader.accept("that") or reader.next in ("entering", "exiting", "leaving", "colliding", "hitting"):
        return (*_acting(reader, phrase), "exist")
    return (*reader.first(lambda: _stated_state(reader, phrase), lambda: _of_state(reader, phrase)), "exist")


def _doing(reader: Reader) -> Tokens:
    """'Are any cubes moving when ...?', 'Do any cubes enter the scene?', 'Does the cube collide with the sphere?'."""
    if reader.accept("are any", "is any"):
        return (*_stated_state(reader, noun_phrase(reader)), "exist")
    if reader.accept("do any", "does any"):
        return (*_acting(reader, noun_phrase(reader)), "exist")
    if reader.accept("is"):
        reader.expect("the")
        phrase = NounPhrase((*plain_noun(reader, plural=False),), plural=False)
        return (*_stated_state(reader, phrase), "exist")
    reader.expect("does", "do", "did")
    return (*_named_event(reader), *condition(reader), "exist")


def _named_event(reader: Reader) -> Tokens:
    """'the cube enter the scene', 'the cube and the sphere collide': the set of events, empty or of one."""
    return the_event(reader)[:-1]


def _attribute(reader: Reader) -> Tokens:
    """'What is the color of ...?', 'What color is ...?', 'What is ... made of?'."""
    return reader.first(lambda: _attribute_of(reader), lambda: _attribute_first(reader), lambda: _made_of(reader))


def _attribute_of(reader: Reader) -> Tokens:
    reader.expect("what is the")
    attribute = reader.one_of(ATTRIBUTE_WORDS)
    reader.expect("of")
    return (*_described(reader), f"query_{attribute}")


def _attribute_first(reader: Reader) -> Tokens:
    reader.expect("what", "which")
    attribute = reader.one_of(ATTRIBUTE_WORDS)
    reader.expect("is", "are")
    described = _described(reader)
    if attribute == "material":
        reader.accept("made of")
    return (*described, f"query_{attribute}")


def _made_of(reader: Reader) -> Tokens:
    reader.expect("what is")
    described = _described(reader)
    reader.expect("made of")
    return (*described, "query_material")


def _described(reader: Reader) -> Tokens:
    """One object, by its looks, by what it does, or by what happens to it."""
    reader.expect("the")
    phrase = noun_phrase(reader)
    if phrase.plural:
        raise NoReadingError
    return reader.first(
        lambda: _partner(reader, phrase),
        lambda: _crosser(reader, phrase),
        lambda: _mover(reader, phrase),
        lambda: _plain(phrase),
    )


def _plain(phrase: NounPhrase) -> Tokens:
    if not phrase.is_plain:
        raise NoReadingError
    return (*phrase.filters, "unique")


def _chosen(phrase: NounPhrase) -> Tokens:
    if phrase.state is not None:
        raise NoReadingError
    return ("unique",) if phrase.order is None else (phrase.order, "filter_order")


def _partner(reader: Reader, phrase: NounPhrase) -> Tokens:
    chosen = _chosen(phrase)
    reader.accept("to", "that")
    reader.expect(*COLLIDE)
    other = the_object(reader)
    own = () if phrase.filters == ("objects",) else (*phrase.filters, "filter_collision")
    return ("events", *other, "filter_collision", *own, *condition(reader), *chosen, *other, "get_col_partner")


def _crosser(reader: Reader, phrase: NounPhrase) -> Tokens:
    chosen = _chosen(phrase)
    reader.accept("to", "that")
    kind = crossing(reader)
    return ("events", *phrase.filters, kind, *condition(reader), *chosen, "get_object")


def _mover(reader: Reader, phrase: NounPhrase) -> Tokens:
    if phrase.order is not None:
        raise NoReadingError
    state = phrase.state
    if state is None:
        reader.expect("that is", "that was")
        state = reader.one_of(STATES)
    return (*phrase.filters, *moment_or_ever(reader), state, "unique")


def _responsible(reader: Reader) -> Tokens:
    """'Which of the following is not responsible for the collision between A and B?'."""
    reader.expect(*WHICH)
    reader.expect("is", "was", "are")
    negated = reader.accept("not")
    reader.expect("responsible for")
    ancestors = ("events", *the_event(reader), "filter_ancestor", "belong_to")
    return _negated(ancestors, negated)


def _next(reader: Reader) -> Tokens:
    """'What will happen next?', 'What happens next?'."""
    reader.expect(*WHICH)
    negated = _happening(reader)
    reader.expect("next", "after the video ends", "after the video")
    return _negated(("unseen_events", "belong_to"), negated)


def _changed(reader: Reader) -> Tokens:
    """'If the X is removed, what will not happen?', and the same the other way round."""
    return reader.first(lambda: _change_last(reader), lambda: _change_first(reader), lambda: _what_if(reader))


def _change_last(reader: Reader) -> Tokens:
    reader.expect(*WHICH)
    negated = _happening(reader)
    return _negated(("all_events", *_change(reader), "belong_to"), negated)


def _change_first(reader: Reader) -> Tokens:
    change = _change(reader)
    reader.expect(*WHICH)
    return _negated(("all_events", *change, "belong_to"), _happening(reader))


def _what_if(reader: Reader) -> Tokens:
    reader.expect("what")
    return ("all_events", *_change(reader), "belong_to")


def _happening(reader: Reader) -> bool:
    """'will not happen', 'happens', 'would have happened'; whether it is negated."""
    if reader.accept("happens", "happen"):
        return False
    reader.expect("will", "would", "could")
    negated = reader.accept("not")
    reader.expect("happen", "have happened")
    return negated


def _change(reader: Reader) -> Tokens:
    """'without the X', 'if the X were five times heavier', 'if the X were' another word for a change."""
    if reader.accept("without"):
        return (*the_object(reader), "get_counterfact")
    reader.expect("if")
    changed = the_object(reader)
    reader.expect("is", "are", "was", "were", "had been")
    if reader.accept("removed", "taken away", "gone", "not there", "absent"):
        return (*changed, "get_counterfact")
    if reader.accept("five times", "5 times"):
        return (*changed, reader.one_of(COMPARATIVES))
    reader.accept("much")
    return (*changed, reader.one_of(reader.comparatives))


def _yes_no_prediction(reader: Reader) -> Tokens:
    """'Will A collide with B?', 'Would A and B collide without C?'."""
    reader.expect("will", "would")
    first = the_object(reader)
    if reader.accept("and"):
        second = the_object(reader)
        reader.expect("collide", "have collided")
    else:
        reader.expect("collide with", "hit", "have collided with", "have hit")
        second = the_object(reader)
    meeting = collision(first, second, "all_events")
    if reader.place < len(reader.words) and not reader.accept("next", "after the video ends", "after the video"):
        return (*meeting, "all_events", *_change(reader), "belong_to")
    return (*meeting, "unseen_events", "belong_to")


def _negated(program: Tokens, negated: bool) -> Tokens:
    return (*program, "negate") if negated else program
