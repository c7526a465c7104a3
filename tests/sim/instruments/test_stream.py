"""The simulated serial instrument by itself, against frames written by hand."""

from __future__ import annotations

import pytest

from stream_rig import stream
from winchkit.errors import FileError, UsageError
from winchkit.schema.devices.stream import StreamSpec
from winchkit.sim.instruments.stream import SimulatedStreamInstrument, shown_by
from winchkit.sim.instruments.stream_frames import IndicatorState, NumberStyle, Speech, style_of


def state(number: float, **more: object) -> IndicatorState:
    given: dict[str, object] = {
        "net": number,
        "gross": number,
        "motion": 0.0,
        "tared": False,
        "overload": False,
        "broken": False,
        "address": 1,
        **more,
    }
    return IndicatorState(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "number", "frame"),
    [
        ("laumas-tlb-ascii", 12345, b"&T012345P012345\\04\r"),
        ("laumas-tlb-ascii", -123, b"&T-00123P-00123\\04\r"),
        ("mantracourt-dsc-ascii", -1.5, b"-1.500\r"),
        ("hbm-aed-ascii", -500_000, b"-0500000,01,008\r\n"),
        ("hbm-aed-binary", -5_120_000, b"\xb1\xe0\x00\x08\r\n"),
        ("hbm-aed-binary", 0x0D0A0D, b"\x0d\x0a\x0d\x08\r\n"),
        ("flintec-ldu", 1.0, b"N+01.000\r\n"),
        ("and-ad-4406", 12.34, b"ST,GS,+0012.34kg\r\n"),
        ("mettler-mt-sics", 100.0, b"S S     100.00 g\r\n"),
        ("mettler-mt-sics", -0.02, b"S S      -0.02 g\r\n"),
        ("sartorius-sbi", 123.56, b"+   123.56 g  \r\n"),
        ("sartorius-sbi", -0.1, b"-     0.10 g  \r\n"),
        ("hx711-line", -12.34, b"-12.34\n"),
    ],
)
def test_frames_look_like_the_manuals(name: str, number: float, frame: bytes) -> None:
    assert Speech(stream(name)).frame(state(number)) == frame


@pytest.mark.parametrize(
    ("name", "frame"),
    [
        ("laumas-tlb-ascii", b"&T O-L  P O-L  \\04\r"),
        ("and-ad-4406", b"OL,GS,        kg\r\n"),
        ("mettler-mt-sics", b"S +\r\n"),
        ("sartorius-sbi", b"High\r\n"),
    ],
)
def test_overload_in_the_words_of_each(name: str, frame: bytes) -> None:
    broken = state(float("nan"), overload=True)
    assert Speech(stream(name)).frame(broken) == frame


def test_a_moving_value_and_a_tare_are_said() -> None:
    speech = Speech(stream("and-ad-4406"))
    assert speech.frame(state(1.0, motion=5.0, tared=True)) == b"US,NT,+0001.00kg\r\n"


def test_old_values_are_said_by_their_bit() -> None:
    speech = Speech(stream("mantracourt-dsc-ascii"))
    assert speech.status(state(1.0), old=True) == b"8192\r"
    assert speech.status(state(1.0), old=False) == b"0\r"
    assert speech.status(state(float("nan"), overload=True), old=False) == b"512\r"


@pytest.mark.parametrize(
    ("text", "width", "style"),
    [
        ("+0012.34", 8, NumberStyle(8, 2, plus=True, zeros=True, sign_first=False)),
        ("    100.00", 10, NumberStyle(10, 2, plus=False, zeros=False, sign_first=False)),
        ("+   123.56", 10, NumberStyle(10, 2, plus=True, zeros=False, sign_first=True)),
        ("-12.34", None, NumberStyle(None, 2, plus=False, zeros=False, sign_first=False)),
        ("0.5", None, NumberStyle(None, 1, plus=False, zeros=False, sign_first=False)),
    ],
)
def test_the_style_of_a_number(text: str, width: int | None, style: NumberStyle) -> None:
    assert style_of(text, width) == style


def test_a_number_that_is_too_long_is_not_cut() -> None:
    assert style_of("+0012.34", 8).write(123_456.0) is None


def test_requests_are_found_among_garbage_and_in_pieces() -> None:
    one = SimulatedStreamInstrument(stream("flintec-ldu"), lambda: 1.0, now=0.0, address=2)
    one.convert()
    one.show(1.0)
    for piece in (b"\x00xxG", b"N\r", b"\nOP 1\r\nGN\r\nOP 2\r", b"\nGN\r\n"):
        one.receive(piece, 1.0)
    assert one.take_output(1.0) == b"OK\r\nN+01.000\r\n", "only when its own address is open"


def test_a_late_answer_comes_late() -> None:
    one = SimulatedStreamInstrument(stream("mettler-mt-sics"), lambda: 1.0, now=0.0)
    one.inject("late reply")
    one.receive(b"SI\r\n", 1.0)
    assert one.take_output(1.3) == b""
    assert one.take_output(1.4) != b""


def test_an_unknown_fault_names_those_there_are() -> None:
    one = SimulatedStreamInstrument(stream("flintec-ldu"), lambda: 1.0, now=0.0)
    with pytest.raises(UsageError, match=r"silence.*did you mean 'half line'"):
        one.inject("half lin")


def test_a_mass_is_shown_for_a_force() -> None:
    assert shown_by(stream("and-ad-4406"), lambda: 9.80665)() == pytest.approx(1.0)
    assert shown_by(stream("mettler-mt-sics"), lambda: 9.80665)() == pytest.approx(1000.0)
    assert shown_by(stream("laumas-tlb-ascii"), lambda: 123.45)() == pytest.approx(12345.0)


def test_an_example_that_does_not_fit_is_refused() -> None:
    wrong = StreamSpec("continuous", "X1.5", frame=("N{value:3}",), unit="N")
    with pytest.raises(FileError, match=r"the example 'X1.5' does not fit 'N\{value:3\}'"):
        Speech(wrong)
