"""Unit: equal estimators have equal bytes, what differs differs."""

import zipfile
from datetime import datetime
from io import BytesIO

import numpy as np
import pytest

from sigdb.recognition import LocationClassifier
from sigdb.recognition.storage.skops_file import skops_bytes, skops_estimators


def estimator(coverage=0.5):
    one = LocationClassifier(learner="lda", coverage=coverage)
    one.slope_, one.none_ = np.arange(3.0), np.arange(3.0)
    one.classes_ = np.arange(13)
    return one


def test_equal_estimators_have_equal_bytes_whatever_objects_they_share():
    one, other = estimator(), estimator(coverage=float("0.5"))
    other.learner = "".join(["l", "da"])
    assert other.learner is not one.learner
    assert skops_bytes({"lda": one}) == skops_bytes({"lda": other})


def test_others_have_other_bytes():
    assert skops_bytes({"lda": estimator()}) != skops_bytes({"lda": estimator(coverage=0.6)})


def test_neither_times_nor_addresses_are_written():
    one = estimator()
    content = skops_bytes({"lda": one})
    with zipfile.ZipFile(BytesIO(content)) as archive:
        assert {datetime(*entry.date_time) for entry in archive.infolist()} == {datetime(1980, 1, 1)}
        text = archive.read("schema.json").decode()
    assert str(id(one.slope_)) not in text


@pytest.mark.parametrize("names", [["a"], ["a", "b", "c"]])
def test_what_is_written_is_read_in_its_order(names):
    read = skops_estimators(skops_bytes({name: estimator() for name in names}))
    assert list(read) == names
    for one in read.values():
        np.testing.assert_array_equal(one.classes_, np.arange(13))
        assert one.get_params() == estimator().get_params()
