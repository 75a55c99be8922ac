"""Every status has a text of its own, for one answer or many."""

import numpy as np
import pytest

from reojax.optimisation.status import Status, describe


def test_every_status_has_words_of_its_own():
    texts = [status.text for status in Status]
    assert len(set(texts)) == len(Status)
    assert all(s.text.partition(":")[0] == s.name.lower().replace("_", " ") for s in Status)


def test_one_or_many():
    assert describe(np.int32(0)) == "converged"
    assert describe(np.array([0, 2])) == [Status.CONVERGED.text, Status.STALLED.text]
    with pytest.raises(ValueError, match="99"):
        describe(99)
