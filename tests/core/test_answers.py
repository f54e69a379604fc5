"""Unit: one table of answers, whose kinds all have a sentence, an exit code and a meaning."""

from typing import get_args

import pytest

from sigdb.core import ANSWERS, Answer, Kind


def test_every_kind_has_its_form():
    assert set(ANSWERS) == set(get_args(Kind))
    assert {form.exit_code for form in ANSWERS.values()} == {0, 1, 3}
    assert all(form.sentence.endswith(".") and form.meaning for form in ANSWERS.values())
    assert [kind for kind, form in ANSWERS.items() if form.exit_code == 3] == ["cannot be judged"]


@pytest.mark.parametrize(
    ("candidates", "kind", "code", "sentence"),
    [
        ((0,), "nothing stands out", 0, "Nothing stands out of what healthy gears show."),
        ((6,), "one tooth", 1, "One tooth stands out: 6."),
        ((6, 7), "one tooth", 1, "One tooth stands out: 6 or 7."),
        ((0, 3, 6), "cannot be judged", 3, "Cannot be judged: no damage and damage at tooth 3 or 6 are both likely."),
        ((), "cannot be judged", 3, "Cannot be judged: neither a tooth nor the absence of damage is likely."),
    ],
)
def test_a_set_of_teeth_is_an_answer(candidates, kind, code, sentence):
    answer = Answer.of_teeth(candidates)
    assert (answer.kind, answer.exit_code, str(answer)) == (kind, code, sentence)


def test_a_sentence_without_its_values_is_a_mistake():
    with pytest.raises(KeyError, match="reason"):
        Answer.of("cannot be judged")
