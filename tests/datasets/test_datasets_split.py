"""Splits keep a person on one side."""

from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from hemline.datasets.split import split_by_subject


@dataclass(frozen=True)
class Row:
    subject: str
    clip: str
    clip_frames: int


rows_of = st.lists(
    st.builds(Row, st.sampled_from("abcdefghij"), st.text("xyz", min_size=1, max_size=3), st.integers(1, 400)),
    min_size=1,
    max_size=60,
)


@given(rows_of)
@settings(max_examples=200, deadline=None)
def test_every_row_is_on_exactly_one_side_and_so_is_every_subject(rows):
    sides = split_by_subject(rows, (0.8, 0.1, 0.1))
    assert sorted(map(repr, sum(sides.values(), []))) == sorted(map(repr, rows))
    subjects = {row.subject for row in rows}
    key = (lambda row: row.subject) if len(subjects) >= 3 else (lambda row: row.clip)
    seen = [set(map(key, side)) for side in sides.values()]
    assert not (seen[0] & seen[1] or seen[0] & seen[2] or seen[1] & seen[2])
    assert sides["train"]
    if len(subjects) >= 3:
        assert sides["val"] and sides["test"]


def test_shares_are_near_eighty_ten_ten_where_subjects_allow():
    rows = [Row(str(i), f"{i}_1", 100) for i in range(40)]
    sides = split_by_subject(rows, (0.8, 0.1, 0.1))
    assert [len(side) for side in sides.values()] == [32, 4, 4]


def test_the_order_of_rows_does_not_matter():
    rows = [Row(str(i % 7), str(i), 10 + i) for i in range(30)]
    first, second = split_by_subject(rows, (0.8, 0.1, 0.1)), split_by_subject(rows[::-1], (0.8, 0.1, 0.1))
    assert {k: set(v) for k, v in first.items()} == {k: set(v) for k, v in second.items()}
