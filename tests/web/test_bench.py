"""Messages of a browser that commands: none that waited moves a winch."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

pytest.importorskip("starlette")

from hypothesis import given
from hypothesis import strategies as st

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.schema.read import read_simbench
from winchkit.web.browser import Inbox
from winchkit.web.drive_objects import drive_objects


def taken(inbox: Inbox) -> list[dict[str, Any]]:
    """Everything that waits, in its order."""

    async def all_of() -> list[dict[str, Any]]:
        found = []
        while inbox._waiting:
            found.append(await inbox.next())
        return found

    return asyncio.run(all_of())


@given(st.lists(st.sampled_from(["jog", "release", "step", "alive", "leave"])))
def test_of_jogs_that_wait_only_the_newest_is_left_and_every_other_message_ends_it(
    names: list[str],
) -> None:
    inbox = Inbox()
    for number, name in enumerate(names):
        inbox.put({"do": name, "number": number})
    left = taken(inbox)
    others = [n for n, name in enumerate(names) if name != "jog"]
    assert [item["number"] for item in left if item["do"] != "jog"] == others
    jogs = [item["number"] for item in left if item["do"] == "jog"]
    assert jogs == ([len(names) - 1] if names and names[-1] == "jog" else [])


@pytest.mark.parametrize("phase", ["moving", "running down", "enabling", None])
def test_objects_are_not_read_where_a_winch_is_not_disabled(phase: str | None) -> None:
    spec = read_simbench(find("sim", "demo-adequate")).bench
    status = {} if phase is None else {"winch": {"A": {"phase": phase}}}
    with pytest.raises(UsageError, match="where it is disabled"):
        drive_objects(spec, status, "A")
    with pytest.raises(UsageError, match="there is no winch 'B'"):
        drive_objects(spec, status, "B")
