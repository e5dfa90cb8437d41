# SPDX-License-Identifier: GPL-3.0-or-later
"""What is varied: ranges, lists and tables of a person's words, and the points that they span."""

from pathlib import Path

import pytest

from nim_addon.sweeps import axes
from nim_addon.sweeps.axes import Axis, axis


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("n=-1.5:1.5:0.5", "-1.5 -1 -0.5 0 0.5 1 1.5"),
        ("n=1:-1:-1", "1 0 -1"),
        ("n=0.1:0.7:0.2", "0.1 0.3 0.5 0.7"),  # which floats would make 0.30000000000000004 of, and end at 0.5
        ("n=0:1:0.4", "0 0.4 0.8"),
        ("n=2:2:1", "2"),
        ("n=10:30:10", "10 20 30"),
        (" mu = -1 , -10 ", "-1 -10"),
    ],
)
def test_values_are_as_they_are_written(text, values):
    assert axis(text).values == tuple(values.split())


def test_commas_part_values_but_not_media():
    assert axis("liquid=none,n=-1.33,mu=-10,drude(1,2)").values == ("none", "n=-1.33,mu=-10", "drude(1,2)")
    assert axis("NIM:Index Inside=-2:-1:1") == Axis("NIM:Index Inside", ("-2", "-1"))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("n", "is not understood"),
        ("=1,2", "is not understood"),
        ("n=", "is not understood"),
        ("n=1:2", "has no step"),
        ("n=1:2:0", "step of 0"),
        ("n=2:1:1", "steps away from its end"),
        ("n=0:inf:1", "never ends"),
        ("n=nan:1:1", "never ends"),
        ("n=0:1:1e-9", "more than 10000000"),
        ("n=1,,2", "an empty value"),
        ("n=1,2,1", "names 1 twice"),
    ],
)
def test_words_that_are_no_axis(text, told):
    with pytest.raises(ValueError, match=told) as refused:
        axis(text)
    assert str(refused.value).startswith("--vary") and str(refused.value).endswith(".")


def test_points_span_or_go_together():
    two = [axis("a=1,2"), axis("b=3,4")]
    assert [tuple(point.values()) for point in axes.points(two)] == [("1", "3"), ("1", "4"), ("2", "3"), ("2", "4")]
    assert list(axes.points(two, together=True)) == [{"a": "1", "b": "3"}, {"a": "2", "b": "4"}]
    assert (axes.count(two), axes.count(two, together=True), list(axes.points([]))) == (4, 2, [{}])
    with pytest.raises(ValueError, match="here are a 2, b 3"):
        axes.points([axis("a=1,2"), axis("b=1,2,3")], together=True)
    with pytest.raises(ValueError, match="names a twice"):
        axes.points([axis("a=1,2"), axis("a=3")])


def test_a_table_holds_points(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text('\ufeffn, mu\n-1.5,-1\n\n-1.33,\n"-2","-3"\n', encoding="utf-8")
    assert axes.table(file) == [{"n": "-1.5", "mu": "-1"}, {"n": "-1.33"}, {"n": "-2", "mu": "-3"}]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"n,mu\n", "has no points"),
        (b"", "has no points"),
        (b"n,n\n1,2\n", "each once"),
        (b"n,\n1,2\n", "name each column"),
        (b"n,mu\n1,2\n3\n", "line 3 of"),
        (b"n\n\xff\xfe\n", "no table of text"),
        (b'n\n"1\n', "is no CSV"),
    ],
)
def test_what_is_no_table(tmp_path, content, told):
    file = tmp_path / "points.csv"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=told):
        axes.table(file)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a file that never ends")
def test_a_table_that_may_never_end():
    with pytest.raises(ValueError, match="/dev/zero is no table of text"):
        axes.table("/dev/zero")
