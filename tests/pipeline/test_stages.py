"""Unit: a stage is kept while its files are as they were made and its inputs are the same."""

import pytest

from sigdb.pipeline import stages
from sigdb.pipeline.stages import Stage, run_stage


@pytest.fixture
def carried_out(tmp_path):
    """Carry out a stage that writes two files; the words that it said, and how often it was made."""
    made = []

    def run(said="one", **inputs):
        stage = Stage(out=tmp_path, name="things", inputs={"numbers": (1, 2), "of": {"a": None}} | inputs)

        def make():
            made.append(said)
            stage.path.mkdir(exist_ok=True)
            files = [stage.path / "a.txt", stage.path / "b.txt"]
            for file in files:
                file.write_text(said, encoding="utf-8")
            return files

        words = []
        run_stage(stage, make, words.append, "made")
        assert words[0].startswith(f"{tmp_path / 'things'}: ")
        return words[0].split(": ")[1], len(made)

    return run


def test_a_stage_is_made_once(carried_out):
    assert carried_out() == ("made", 1)
    assert carried_out() == ("unchanged", 1)


def test_other_inputs_make_it_again_also_when_they_come_back(carried_out):
    carried_out()
    assert carried_out(numbers=(1, 3)) == ("made", 2)
    assert carried_out(numbers=(1, 3)) == ("unchanged", 2)
    assert carried_out() == ("made", 3)


@pytest.mark.parametrize("package", ["sigdb", "scikit-learn"])
def test_another_version_makes_it_again(carried_out, monkeypatch, package):
    carried_out()
    monkeypatch.setattr(stages, "_VERSIONS", stages._VERSIONS | {package: "0.0"})
    assert carried_out() == ("made", 2)


@pytest.mark.parametrize("name", ["things/a.txt", "things/b.txt", "receipts/things.json"])
@pytest.mark.parametrize("content", [None, "", "two"])
def test_a_file_that_is_gone_empty_or_another_makes_it_again(carried_out, tmp_path, name, content):
    carried_out()
    if content is None:
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_text(content, encoding="utf-8")
    assert carried_out() == ("made", 2)
    assert carried_out() == ("unchanged", 2)
    assert (tmp_path / "things" / "a.txt").read_text(encoding="utf-8") == "one"


def test_a_stage_that_is_stopped_while_it_is_made_again_is_not_taken_for_what_was_there(tmp_path, carried_out):
    """Half of new content over the old, then back to the old inputs: the old receipt is still there."""
    carried_out()
    stage = Stage(out=tmp_path, name="things", inputs={"numbers": 5})

    def stopped():
        (stage.path / "a.txt").write_text("half", encoding="utf-8")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_stage(stage, stopped, lambda said: None, "made")
    assert carried_out() == ("made", 2)


def test_files_that_are_none_of_a_stage_s_do_not_count(carried_out, tmp_path):
    carried_out()
    (tmp_path / "things" / "notes.txt").write_text("mine", encoding="utf-8")
    assert carried_out() == ("unchanged", 1)
