"""Names people use: of races and of drivers. Each names the one that is meant, or is refused in one line with hints by meaning."""

import csv
import dataclasses
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_race import synthetic_race

from rsrl.cli import main
from rsrl.errors import RsrlError
from rsrl.evaluation.study import race_of_track
from rsrl.season import (
    GRAND_PRIX,
    RaceRecord,
    circuit_of,
    drivers,
    find_car,
    grand_prix_of,
    load_race,
    race_heads,
    race_names,
    resolve_race,
    shipped_folder,
    track_code,
)
from rsrl.season.circuits import CIRCUITS, GRANDS_PRIX, SEVERAL, circuit_name, is_held, spoken_names
from rsrl.season.drivers import CHAMPION_WITH_1, DRIVERS

KNOWN = race_names()


def refusal(text: str) -> str:
    with pytest.raises(RsrlError) as caught:
        resolve_race(text, KNOWN)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "race"),
    [
        ("Bahrain-2023", "bahrain-2023"),
        ("monza-2023", "italy-2023"),
        ("spa-2023", "belgium-2023"),
        ("Spa-Francorchamps 2022", "belgium-2022"),
        ("silverstone-2024", "great-britain-2024"),
        ("cota-2023", "united-states-2023"),
        ("Circuit of the Americas 2023", "united-states-2023"),
        ("US Grand Prix 2023", "united-states-2023"),
        ("us gp 2023", "united-states-2023"),
        ("uk-2023", "great-britain-2023"),
        ("Italian Grand Prix 2023", "italy-2023"),
        ("2023 Bahrain Grand Prix", "bahrain-2023"),
        ("Bahrain International Circuit 2024", "bahrain-2024"),
        ("F1 2023 Bahrain GP", "bahrain-2023"),
        ("São Paulo 2023", "brazil-2023"),
        ("Sa\u0303o Paulo 2023", "brazil-2023"),
        ("sao_paulo-2022", "brazil-2022"),
        ("saopaulo-2022", "brazil-2022"),
        ("São Paulo Grand Prix 2023", "brazil-2023"),
        ("brazil-2023", "brazil-2023"),
        ("Interlagos 23", "brazil-2023"),
        ("great_britain_2023", "great-britain-2023"),
        ("Great Britain 2023", "great-britain-2023"),
        ("  ABU   DHABI 2023 ", "abu-dhabi-2023"),
        ("bahrain2023", "bahrain-2023"),
        ("Imola, Italy 2022", "emilia-romagna-2022"),
        ("Italy Monza 2022", "italy-2022"),
        ("Austin USA 2023", "united-states-2023"),
        ("United Arab Emirates 2023", "abu-dhabi-2023"),
        ("Monza " * 60 + "2023", "italy-2023"),
        ("bahrain", "bahrain-2025"),
        ("French GP", "france-2022"),
        ("Italy", "italy-2025"),
    ],
)
def test_what_people_call_a_race(text: str, race: str) -> None:
    assert resolve_race(text, KNOWN) == race


def test_every_shipped_race_goes_by_its_name_its_event_and_its_circuit() -> None:
    for head in race_heads():
        slug = head.name.rpartition("-")[0]
        for text in (head.name, head.name.upper(), f"{head.season} {head.event}", f"{head.event} {head.season}"):
            assert resolve_race(text, KNOWN) == head.name
        assert resolve_race(f"{circuit_name(slug, head.season)} {head.season}", KNOWN) == head.name
        assert resolve_race(slug, KNOWN) == max((h.season, h.name) for h in race_heads() if h.name.startswith(f"{slug}-2"))[1]


@pytest.mark.parametrize("season", [2016, 2020, 2024, 2026])
def test_a_name_in_the_table_stands_for_one_grand_prix_of_a_season(season: int) -> None:
    meanings: dict[str, set[str]] = {}
    for slug in GRANDS_PRIX:
        for name in spoken_names(slug, season) if is_held(slug, season) else ():
            meanings.setdefault(name.casefold().replace(" ", "").replace("-", ""), set()).add(slug)
    assert [name for name, of in meanings.items() if len(of) > 1] == []
    assert not {name.casefold() for name in SEVERAL} & set(meanings)


def test_every_grand_prix_of_the_one_hot_track_is_in_the_table_on_a_circuit_that_is_too() -> None:
    assert set(GRAND_PRIX) <= set(GRANDS_PRIX)
    venues = {circuit for grand_prix in GRANDS_PRIX.values() for _, circuit in grand_prix.venues}
    assert venues == set(CIRCUITS)
    assert all(grand_prix.venues == tuple(sorted(grand_prix.venues)) for grand_prix in GRANDS_PRIX.values())


@pytest.mark.parametrize(
    ("event", "season", "slug", "circuit"),
    [
        ("Spanish Grand Prix", 2025, "spain", "catalunya"),
        ("Spanish Grand Prix", 2026, "spain", "madring"),
        ("Barcelona Grand Prix", 2026, "barcelona", "catalunya"),
        ("Barcelona-Catalunya Grand Prix", 2027, "barcelona", "catalunya"),
        ("Madrid Grand Prix", 2026, "madrid", "madring"),
        ("Sakhir Grand Prix", 2020, "sakhir", "bahrain_outer"),
        ("Bahrain Grand Prix", 2020, "bahrain", "bahrain"),
        ("70th Anniversary Grand Prix", 2020, "seventieth-anniversary", "silverstone"),
        ("Styrian Grand Prix", 2021, "styria", "red_bull_ring"),
        ("German Grand Prix", 2013, "germany", "nurburgring"),
        ("German Grand Prix", 2019, "germany", "hockenheimring"),
        ("Mexican Grand Prix", 2019, "mexico", "rodriguez"),
        ("Mexico City Grand Prix", 2021, "mexico", "rodriguez"),
        ("São Paulo Grand Prix", 2021, "brazil", "interlagos"),
        ("Imola Grand Prix", 2027, "imola", "imola"),
        ("Grand Prix of Atlantis", 2026, "atlantis", "atlantis"),
        ("Rwandan Grand Prix", 2028, "rwandan", "rwandan"),
        ("Großer Preis von Köln", 2028, "groer-preis-von-koln", "groer-preis-von-koln"),
        ("", 2028, "unknown", "unknown"),
    ],
)
def test_a_track_is_a_circuit_not_the_name_of_an_event(event: str, season: int, slug: str, circuit: str) -> None:
    assert grand_prix_of(event) == slug
    assert circuit_of(slug, season) == circuit


@pytest.mark.parametrize(
    ("grand_prix", "season", "named"),
    [
        ("spain", 2024, "spain"), ("spain", 2026, None), ("barcelona", 2026, "spain"), ("madrid", 2026, None), ("atlantis", 2026, None),
        ("styria", 2021, "styria"), ("austria", 2021, "austria"), ("sakhir", 2020, "sakhir"), ("bahrain", 2026, "bahrain"),
    ],
)  # fmt: skip
def test_a_policy_that_knows_tracks_by_name_knows_the_circuit(grand_prix: str, season: int, named: str | None) -> None:
    assert track_code(grand_prix, season) == (-1 if named is None else GRAND_PRIX.index(named))


def test_the_code_of_every_track_of_the_categories_is_its_place() -> None:
    assert [track_code(slug, 2024) for slug in GRAND_PRIX] == list(range(len(GRAND_PRIX)))


@pytest.mark.real_data
def test_circuits_are_those_of_the_results_tables(real_data: Path) -> None:
    def rows(name: str) -> list[dict[str, str]]:
        with (real_data / "facts" / f"{name}.csv").open(encoding="utf-8", newline="") as handle:
            return list(csv.DictReader(handle))

    named = {row["circuitId"]: row["circuitRef"] for row in rows("ergast_circuits")}
    races = rows("ergast_races")
    assert len(races) > 150
    for row in races:
        mine = circuit_of(grand_prix_of(row["name"]), int(row["year"]))
        assert mine == ("bahrain_outer" if row["name"] == "Sakhir Grand Prix" else named[row["circuitId"]]), row["name"]


@pytest.mark.parametrize(
    ("text", "race"),
    [
        ("barcelona-2024", "spain-2024"),
        ("barcelona-2026", "barcelona-2026"),
        ("barcelona", "barcelona-2026"),
        ("Catalunya 2026", "barcelona-2026"),
        ("madrid-2026", "spain-2026"),
        ("Madring", "spain-2026"),
        ("Spanish Grand Prix 2026", "spain-2026"),
        ("spain", "spain-2026"),
        ("spain-2024", "spain-2024"),
        ("Atlantis", "atlantis-2026"),
        ("2026 Atlantis Grand Prix", "atlantis-2026"),
    ],
)
def test_a_name_means_the_circuit_of_its_season(text: str, race: str) -> None:
    assert resolve_race(text, ["spain-2024", "spain-2026", "barcelona-2026", "atlantis-2026"]) == race


def test_a_circuit_means_the_race_held_there_whatever_other_race_has_its_old_name() -> None:
    assert resolve_race("barcelona", ["spain-2024", "spain-2026"]) == "spain-2024"
    for text in ("madrid-2024", "madring-2023"):
        with pytest.raises(RsrlError, match="unknown race"):
            resolve_race(text, ["spain-2024", "spain-2026"])


@pytest.mark.parametrize(
    ("text", "hints", "not_there"),
    [
        ("usa-2023", ("united-states-2023 (Circuit of the Americas)", "miami-2023", "las-vegas-2023", "name one of them"), ("2022",)),
        ("us-2022", ("united-states-2022", "miami-2022"), ("vegas",)),
        ("monza-2026", ("no season file of italy (Monza) in 2026", "italy-2022, italy-2023, italy-2024, italy-2025"), ("monaco",)),
        ("imola-2023", ("emilia-romagna-2022, emilia-romagna-2024, emilia-romagna-2025", "in Italy: italy-2023 (Monza)"), ("france",)),
        ("styria-2023", ("in Austria: austria-2023 (Red Bull Ring)",), ("australia",)),
        ("sakhir-2020", ("no season file of sakhir",), ("saudi-arabia-",)),
        ("sochi-2021", ("no season file of russia (Sochi) in 2021; known races: abu-dhabi, australia",), ()),
        ("bahrain-2019", ("no season file of bahrain", "bahrain-2022, bahrain-2023, bahrain-2024, bahrain-2025"), ()),
        ("bahrian-2023", ("unknown race 'bahrian-2023'; known races: abu-dhabi, australia", "(see `rsrl races`)"), ()),
        ("monaco monza 2023", ("unknown race",), ()),
        ("Italian GP Imola 2022", ("unknown race",), ()),
        ("bahrain 2022 2023", ("unknown race",), ()),
        ("2023", ("unknown race",), ()),
        ("grand prix", ("unknown race",), ()),
        ("", ("unknown race ''",), ()),
        ("italy " * 60 + "x", ("unknown race",), ()),
        ("../bahrain-2023", ("unknown race",), ()),
        ("バーレーン-2023", ("unknown race",), ()),
    ],
)
def test_what_names_no_race_or_several_is_refused_with_hints_by_meaning(
    text: str, hints: tuple[str, ...], not_there: tuple[str, ...]
) -> None:
    said = refusal(text)
    for hint in hints:
        assert hint in said
    for other in not_there:
        assert other not in said


@given(st.text(max_size=20) | st.lists(st.sampled_from([*GRANDS_PRIX, "2023", "gp", "usa", "Monza", "x"]), max_size=4).map(" ".join))
def test_any_text_is_one_known_race_or_refused(text: str) -> None:
    try:
        race = resolve_race(text, KNOWN)
    except RsrlError:
        return
    assert race in KNOWN


def test_names_are_those_of_the_folder(tmp_path: Path) -> None:
    shutil.copy(shipped_folder() / "italy-2022.toml", tmp_path)
    assert load_race("Monza", tmp_path).name == "italy-2022"
    with pytest.raises(RsrlError, match=r"no season file of italy \(Monza\) in 2023; there are italy-2022$"):
        load_race("monza-2023", tmp_path)
    shutil.copy(shipped_folder() / "italy-2022.toml", tmp_path / "mine.toml")
    assert load_race("mine", tmp_path).name == "italy-2022"


def test_a_path_is_a_season_file(bahrain: RaceRecord) -> None:
    path = shipped_folder() / "bahrain-2023.toml"
    assert load_race(path) == load_race(str(path)) == bahrain


def test_a_study_takes_the_same_names() -> None:
    assert race_of_track("Monza") == "italy-2023"
    assert race_of_track("São Paulo") == "brazil-2023"
    assert race_of_track("spa-2024") == "belgium-2024"


@pytest.mark.parametrize(
    ("driver", "code"),
    [
        ("HAM", "HAM"), ("ham", "HAM"), (" Ham ", "HAM"), ("44", "HAM"), (44, "HAM"), ("#44", "HAM"), ("hamilton", "HAM"),
        ("HAMILTON", "HAM"), ("Lewis Hamilton", "HAM"), ("Pérez", "PER"), ("perez", "PER"), ("Hulkenberg", "HUL"), ("de Vries", "DEV"),
        ("devries", "DEV"), ("Zhou Guanyu", "ZHO"), ("Guanyu Zhou", "ZHO"), ("1", "VER"), (1, "VER"), (33, "VER"), ("2", "SAR"),
    ],
)  # fmt: skip
def test_what_people_call_a_driver(bahrain: RaceRecord, driver: str | int, code: str) -> None:
    assert bahrain.cars[find_car(bahrain, driver)].driver == code


def test_every_driver_of_the_shipped_races_is_in_the_table() -> None:
    table = {driver.code: driver for driver in DRIVERS}
    assert len(table) == len(DRIVERS)
    for name in KNOWN:
        record = load_race(name)
        for i, car in enumerate(record.cars):
            driver = table[car.driver]
            assert find_car(record, driver.surname) == i
            assert find_car(record, f"{driver.given} {driver.surname}") == i
            for number in driver.numbers:
                assert find_car(record, number) == i, "nobody else in the race has the number"
        assert record.cars[find_car(record, 1)].driver == CHAMPION_WITH_1[record.season]


@pytest.mark.parametrize("driver", ["schumacher", "SEN", "", "99", 0, "Hamilton Lewis Jr", "é"])
def test_who_did_not_start_is_refused(bahrain: RaceRecord, driver: str | int) -> None:
    with pytest.raises(RsrlError, match=r"^unknown driver .* for bahrain-2023; who started: ALB, .*ZHO$"):
        find_car(bahrain, driver)


def test_a_code_outside_the_table_works_and_number_1_is_no_ones_without_a_champion() -> None:
    record = synthetic_race()
    assert find_car(record, "c03") == 3
    with pytest.raises(RsrlError, match="unknown driver 1 "):
        find_car(record, 1)


def test_an_ambiguous_surname_is_refused_with_both_codes(bahrain: RaceRecord, monkeypatch: pytest.MonkeyPatch) -> None:
    other = drivers.Driver("RSC", "Ralf", "Schumacher", (7,))
    monkeypatch.setattr(drivers, "DRIVERS", (*DRIVERS, other))
    renamed = {"HAM": "MSC", "RUS": "RSC"}
    cars = tuple(dataclasses.replace(car, driver=renamed.get(car.driver, car.driver)) for car in bahrain.cars)
    record = dataclasses.replace(bahrain, cars=cars)
    with pytest.raises(RsrlError, match=r"^driver 'Schumacher' may be MSC or RSC at bahrain-2023; name one by the code$"):
        find_car(record, "Schumacher")
    assert record.cars[find_car(record, "Ralf Schumacher")].driver == "RSC"
    assert record.cars[find_car(record, "rsc")].driver == "RSC"


COMMANDS = {
    "simulate": ["simulate", "monza-2023"],
    "plan": ["plan", "monza-2023"],
    "evaluate": ["evaluate", "all", "--race", "monza-2023"],
    "explain": ["explain", "all", "--race", "monza-2023", "--lap", "5"],
    "train": ["train", "monza-2023", "--out", "run"],
    "robustness": ["study", "robustness", "all", "--race", "monza-2023"],
    "explanations": ["study", "explanations", "all", "--race", "monza-2023"],
    "generalise": ["study", "generalise", "--tracks", "monza", "--strategists", "heuristic", "--models", "", "--out", "study"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_reads_names(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*COMMANDS[command], "--driver", "senna"]) == 2
    assert capsys.readouterr().err.startswith("rsrl: error: unknown driver 'senna' for italy-2023; who started: ALB, ")
