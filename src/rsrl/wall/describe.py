"""Messages that describe what there is and what is watched: the welcome and the session."""

from collections import Counter
from typing import Any

from rsrl import __version__
from rsrl.drawing.teams import TEAM_COLOURS, team_colour
from rsrl.season.drivers import CHAMPION_WITH_1, DRIVERS
from rsrl.wall.catalogue import Catalogue
from rsrl.wall.messages import FASTEST, MOST_DELAY_S, SLOWEST, Limits, SessionCar, Welcome
from rsrl.wall.messages import Session as SessionMessage
from rsrl.wall.sessions import Session
from rsrl.wall.settings import MESSAGE_BYTES, Settings


def welcome(viewer: str, settings: Settings, catalogue: Catalogue) -> Welcome:
    """The welcome, and later once more when all lap files have been read."""
    return Welcome(
        viewer=viewer,
        rsrl=__version__,
        model=settings.model,
        races=catalogue.races,
        recordings=catalogue.recordings,
        limits=Limits(
            message_bytes=MESSAGE_BYTES,
            viewers=settings.viewers,
            sessions=settings.sessions,
            delay_s=MOST_DELAY_S,
            slowest=SLOWEST,
            fastest=FASTEST,
        ),
    )


def session_message(session: Session, driver: str) -> SessionMessage:
    """What a viewer watches."""
    from rsrl.wall.explanations import possible

    head = session.head
    return SessionMessage(
        session=session.name,
        kind=head.kind,
        race=head.race,
        event=head.event,
        season=head.season,
        laps=head.laps,
        seed=head.seed,
        race_number=head.race_number,
        driven=head.driven,
        driver=driver,
        model=session.policy.name,
        note=head.note,
        methods=possible(session.policy, head.kind == "simulated") if head.record is not None else (),
        pit_losses_s=_pit_losses_s(head.record, driver),
        cars=_cars(session),
    )


def drivers_of(session: Session) -> tuple[str, ...]:
    """Codes of the cars that can be looked at; empty where the source has not said yet who starts."""
    head = session.head
    return tuple(car.driver for car in head.record.cars) if head.record is not None else tuple(driver for driver, _ in head.cars)


def _cars(session: Session) -> tuple[SessionCar, ...]:
    head = session.head
    entries = (
        [(car.driver, car.team, car.grid) for car in head.record.cars]
        if head.record is not None
        else [(driver, team, None) for driver, team in head.cars]
    )
    others = [team for team in dict.fromkeys(team for _, team, _ in entries) if team not in TEAM_COLOURS]
    seen = Counter[str]()
    cars = []
    for driver, team, grid in entries:
        cars.append(
            SessionCar(
                driver=driver,
                number=_number(driver, head.season),
                team=team,
                colour=team_colour(team, others),
                dashed=seen[team] > 0,
                grid=grid,
            )
        )
        seen[team] += 1
    return tuple(cars)


def _number(driver: str, season: int) -> int | None:
    """Car number; None for a driver who is not listed, or has driven with several."""
    if CHAMPION_WITH_1.get(season) == driver:
        return 1
    numbers = next((one.numbers for one in DRIVERS if one.code == driver), ())
    return numbers[0] if len(numbers) == 1 else None


def _pit_losses_s(record: Any, driver: str) -> tuple[float, float, float] | None:
    from rsrl.season import GREEN, SC, VSC
    from rsrl.simulator import compile_figures
    from rsrl.state.race_context import mean_stop_s

    if record is None:
        return None
    cost = mean_stop_s(compile_figures(record), record.car_index(driver))
    return round(float(cost[GREEN]), 2), round(float(cost[VSC]), 2), round(float(cost[SC]), 2)
