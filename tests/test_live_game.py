"""A game followed over UDP as `rsrl live --source game` does, though packets are lost, doubled and late."""

import asyncio
import socket
from collections import deque
from collections.abc import AsyncIterator, Coroutine, Iterable, Iterator
from contextlib import aclosing
from typing import Any

import pytest
from game_race import GameRace, disturbed

from rsrl.feeds import Event
from rsrl.feeds.anomalies import Anomalies
from rsrl.feeds.games import live_game_events, play
from rsrl.live import LiveOptions, Moment, follow_live
from rsrl.replay import Asked, Look
from rsrl.season import GREEN, SC
from rsrl.translators import TrackedCar


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def over_udp(packets: Iterable[tuple[float, bytes]], asked: Asked, monkeypatch: pytest.MonkeyPatch) -> Iterator[Moment]:
    """The moments of a race that is sent to a port of this machine, packet by packet as fast as they are taken from it.

    Sender and listener share a loop, so that what is lost is what the test loses, however busy the machine is.
    """

    async def listened(port: int, anomalies: Anomalies) -> AsyncIterator[Event]:
        sending: asyncio.Task[int] | None = None
        async with aclosing(live_game_events(port, anomalies, patience_s=3.0)) as events:
            sending = asyncio.ensure_future(_soon(play(packets, port, speed=1e9)))
            async for event in events:
                yield event
        await sending

    monkeypatch.setattr("rsrl.live.sources.live_game_events", listened)
    yield from follow_live("game", asked, None, options=LiveOptions(port=free_port()))


async def _soon(sending: Coroutine[Any, Any, int]) -> int:
    await asyncio.sleep(0.2)
    return await sending


def check_cars(race: GameRace, cars: Iterable[TrackedCar]) -> None:
    """Every car's laps, stop and tyres are those of the race."""
    for car in cars:
        slot = car.number - 1
        assert car.laps == race.laps
        for lap in range(1, race.laps + 1):
            assert car.crossings[lap] == pytest.approx(race.crossings[slot, lap - 1], abs=0.02)
        assert [visit.lap for visit in car.visits] == [race.stop_lap[slot]]
        assert [(stint.fitted_lap, stint.compound) for stint in car.stints] == [(0, "S"), (race.stop_lap[slot], "H")]


def check_states(race: GameRace, finals: dict[int, Look]) -> None:
    """The last state of each lap is of the order of that lap, as far as cars are on it."""
    assert set(finals) >= set(range(1, race.laps))
    for lap, look in finals.items():
        state = look.tracked.state
        if state is None or not lap:
            continue
        done = race.crossings[:, lap - 1]
        for car in state.cars:
            slot = ord(car.driver[0]) - 65
            if lap + 1 == race.stop_lap[slot] or not car.running:
                continue  # it may have boxed already, on the lap under way
            assert car.gap_to_leader_s is not None
            assert car.compound == ("H" if race.stop_lap[slot] <= lap else "S")
            if done[slot] > race.crossings[0, lap] - 10:
                continue  # a lap down, it has not crossed the line yet
            assert car.tyre_age_laps == (lap - race.stop_lap[slot] if race.stop_lap[slot] <= lap else lap)


def followed(moments: Iterable[Moment]) -> tuple[Moment, dict[int, Look]]:
    """The last moment, and the look that counts of each lap of the called car by laps completed."""
    last = deque(moments, maxlen=1).pop()
    assert last.watch.car is not None
    finals = (lap.final for lap in last.watch.car.laps if lap.looks)
    return last, {look.tracked.state.laps_completed: look for look in finals if look.tracked.state is not None}


@pytest.mark.slow
def test_57_laps_of_22_cars_over_udp_give_the_states_of_the_race(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lap data twice a second; 1 % of the packets lost, 1 % doubled, 1 % overtaken by the next four."""
    race = GameRace(2023, cars=22, laps=57)
    last, states = followed(over_udp(disturbed(race.packets(), seed=3), Asked(driver="AXQ", season_from="bahrain-2023"), monkeypatch))
    assert last.tracker.over
    check_cars(race, last.tracker.cars.values())
    check_states(race, states)
    assert [span.status for span in last.tracker.spans[1:]] == [SC, GREEN]


@pytest.mark.slow
def test_sixty_packets_a_second_over_udp_give_the_race(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four laps at a game's full rate, disturbed alike; RSRL has no season file for so short a race and tracks it without calls."""
    race = GameRace(2024, cars=22, laps=4, hz=60)
    last, _ = followed(over_udp(disturbed(race.packets(), seed=4), Asked(driver="AXQ"), monkeypatch))
    assert last.tracker.over
    assert last.watch.bound is not None
    assert "tracked without calls" in (last.watch.bound.note or "")
    check_cars(race, last.tracker.cars.values())
