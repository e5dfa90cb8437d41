# SPDX-License-Identifier: GPL-3.0-or-later
"""Words that come from elsewhere."""

import pytest

from nim_addon.base.text import counted, said_by


@pytest.mark.parametrize(
    ("error", "said"),
    [(TimeoutError(), "TimeoutError"), (RuntimeError(" \n"), "RuntimeError"), (OSError("two\nlines "), "two lines")],
)
def test_an_error_says_something_in_one_line(error, said):
    assert said_by(error) == said


def test_what_is_counted_is_one_or_many():
    assert [counted(count, "sample") for count in (0, 1, 2)] == ["0 samples", "1 sample", "2 samples"]
