"""A season file that is broken, incomplete or absurd is refused in one line that names file and figure."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rsrl.errors import RsrlError
from rsrl.season import RaceRecord, find_car, load_race, race_names, read_race, shipped_folder

SHIPPED = shipped_folder() / "bahrain-2023.toml"


def refusal(path: Path) -> str:
    """The message with which a file is refused: one line, which begins with the file's path."""
    with pytest.raises(RsrlError) as caught:
        read_race(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@pytest.fixture
def edited(tmp_path: Path) -> Callable[[str, str], Path]:
    """Makes a copy of the shipped file with the line that begins with `start` replaced by `line` ("" removes it)."""

    def edit(start: str, line: str) -> Path:
        lines = SHIPPED.read_text(encoding="utf-8").splitlines()
        at = next(i for i, text in enumerate(lines) if text.startswith(start))
        lines[at] = line
        path = tmp_path / "race.toml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    return edit


@pytest.mark.parametrize(
    ("start", "line", "message"),
    [
        ("schema", "", "not a season file of schema 1"),
        ("schema", "schema = 99", "not a season file of schema 1"),
        ("laps =", "", "laps is missing; make the file again"),
        ("base_lap_s", "", "track.base_lap_s is missing; make the file again"),
        ("[pit]", "[bit]", "pit is missing"),
        ("base_lap_s", "base_lap_s = 93.5", "track.base_lap_s must be a figure with value, se and n, found 93.5"),
        ("base_lap_s", "base_lap_s = { value = 93.5, se = 0 }", "track.base_lap_s must be a figure with value, se and n"),
        ("base_lap_s", 'base_lap_s = { value = "93", se = 0, n = 0 }', "track.base_lap_s.value must be a finite number, found '93'"),
        ("base_lap_s", "base_lap_s = { value = nan, se = 0, n = 0 }", "track.base_lap_s.value must be a finite number, found nan"),
        ("base_lap_s", f"base_lap_s = {{ value = 1{'0' * 400}, se = 0, n = 0 }}", "track.base_lap_s.value must be a finite number"),
        ("base_lap_s", "base_lap_s = { value = true, se = 0, n = 0 }", "track.base_lap_s.value must be a finite number, found True"),
        ("base_lap_s", "base_lap_s = { value = 93, se = inf, n = 0 }", "track.base_lap_s.se must be a finite number, found inf"),
        ("base_lap_s", "base_lap_s = { value = 93, se = 0, n = 2.5 }", "track.base_lap_s.n must be a whole number, found 2.5"),
        ("base_lap_s", "base_lap_s = { value = 93, se = 0, n = 0, note = 5 }", "track.base_lap_s.note must be text, found 5"),
        ("base_lap_s", "base_lap_s = { value = 93, se = 0, n = 0, sd = 5 }", "track.base_lap_s.sd is not a part of a figure"),
        ("base_lap_s", "base_lap_s = { value = 9.5, se = 0, n = 0 }", "track.base_lap_s is 9.5, outside the believable range 45 to 150"),
        ("base_lap_s", "base_lap_s = { value = 93, se = -1, n = 0 }", "track.base_lap_s has a negative standard error"),
        ("base_lap_s", "base_lap_s = { value = 93, se = 0, n = -3 }", "track.base_lap_s has a negative standard error or sample size"),
        ("retire_per_lap", "retire_per_lap = { value = 0.5, se = 0, n = 0 }", "cars[0].retire_per_lap is 0.5, outside the believable"),
        ("drs_gain_s", "drs_gian_s = { value = 0.4, se = 0, n = 0 }", "track.drs_gain_s is missing"),
        ("event", 'event = "x"\nevnt = "x"', "evnt is not a known figure; remove it"),
        ("[pit]", "[pit]\nloss_s = 3", "pit.loss_s is not a known figure; remove it"),
        ("laps =", "laps = 57.5", "laps must be a whole number, found 57.5"),
        ("laps =", "laps = true", "laps must be a whole number, found True"),
        ("laps =", "laps = 570", "laps is 570, outside the believable range 10 to 90"),
        ("season =", "season = 23", "season is 23, outside the believable range 1950 to 2100"),
        ("round =", "round = 0", "round is 0, outside the believable range 1 to 40"),
        ("max_laps_per_set", "max_laps_per_set = -1", "max_laps_per_set is -1, outside the believable range 0 to 90"),
        ("drs_off_laps", "", "drs_off_laps is missing; make the file again with `rsrl calibrate`"),
        ("drs_off_laps", "drs_off_laps = 11", "drs_off_laps is 11, outside the believable range 0 to 10"),
        ("wet =", "wet = 0", "wet must be true or false, found 0"),
        ("event", "event = 5", "event must be text, found 5"),
        ("name", 'name = "monaco-2023"', "name is 'monaco-2023', but the race is bahrain-2023"),
        ("grand_prix", 'grand_prix = "Mount Panorama"', "grand_prix is 'Mount Panorama'; write it in small letters"),
        ("drs_off_laps", "drs_off_laps = 2\nmin_sets = 1", "min_sets is 1, outside the believable range 2 to 13"),
        ("drs_off_laps", "drs_off_laps = 2\nmin_sets = 8", "no plan can use 8 sets (min_sets): a car has 6"),
        ("drs_off_laps", 'drs_off_laps = 2\nfollowing_aid = "wings"', "following_aid is 'wings'; known are drs, overtake, none"),
        ("max_laps_per_set", "max_laps_per_set = 8", "no plan reaches the flag: 6 sets of 8 laps at most (max_laps_per_set), 57 laps"),
        ("published", 'published = "S-H@18"', "published must be a list, found 'S-H@18'"),
        ("published", "published = [5]", "published[0] must be text, found 5"),
        ("default_driver", 'default_driver = "XXX"', "default_driver XXX is not among the cars"),
        ("sc_laps", "sc_laps = [0.5, 0.4]", "incidents.sc_laps must be 1 to 20 probabilities that sum to 1"),
        ("sc_laps", "sc_laps = [1.5, -0.5]", "incidents.sc_laps must be 1 to 20 probabilities that sum to 1"),
        ("vsc_laps", "vsc_laps = []", "incidents.vsc_laps must be 1 to 20 probabilities that sum to 1"),
        ("vsc_laps", "vsc_laps = [nan]", "incidents.vsc_laps[0] must be a finite number, found nan"),
        ("vsc_laps", f"vsc_laps = [{', '.join(['0.04'] * 25)}]", "incidents.vsc_laps must be 1 to 20 probabilities"),
        (
            "sc_per_retirement =",
            "sc_per_retirement = { value = 0.89, se = 0, n = 0 }",
            "incidents.sc_per_retirement and vsc_per_retirement must not sum to more than 1, found 1.0",
        ),
        ("weight", "weight = 0", "rivals.plans must hold at least one plan, each of positive weight"),
        ("sets", "sets = -1", "tyres.*.sets must be zero or more"),
        ("[tyres.S]", "[tyres.X]", "tyres must be exactly S, M, H, found H, M, X"),
        ('driver = "VER"', 'driver = "PER"', "a driver is listed twice in cars"),
        ("grid = 1", "grid = 2", "cars must stand in grid order"),
        ("grid = 1", "grid = 0", "cars must stand in grid order"),
        ("grid = 20", "grid = 25", "cars must stand in grid order"),
        ("[scaling]", "[scaling]\ngap_s = [0.0]", "scaling.gap_s must have 2 entries, found 1"),
        ("[track]", "[[track]]", "track must be a table"),
        ("season", "season = = 3", "not a TOML file ("),
    ],
)
def test_broken_file_is_refused_by_name_of_the_figure(edited: Callable[[str, str], Path], start: str, line: str, message: str) -> None:
    assert refusal(edited(start, line)).startswith(message)


def test_scaling_is_the_one_part_a_file_may_lack(tmp_path: Path) -> None:
    path = tmp_path / "race.toml"
    path.write_text(SHIPPED.read_text(encoding="utf-8").partition("[scaling]")[0], encoding="utf-8")
    assert read_race(path).scaling == {}


@pytest.mark.parametrize(("cars", "message"), [(1, "1 cars; a race has 2 to 24"), (25, "25 cars; a race has 2 to 24")])
def test_field_of_impossible_size_is_refused(tmp_path: Path, cars: int, message: str) -> None:
    head, *blocks = SHIPPED.read_text(encoding="utf-8").split("[[cars]]")
    last, tail = blocks[-1].split("[rivals]")
    blocks[-1] = last
    path = tmp_path / "race.toml"
    path.write_text("[[cars]]".join([head, *(blocks + blocks)[:cars]]) + "[rivals]" + tail, encoding="utf-8")
    assert refusal(path).startswith(message)


def test_file_without_plans_is_refused(tmp_path: Path) -> None:
    text = SHIPPED.read_text(encoding="utf-8")
    head, *plans = text.split("[[rivals.plans]]")
    rest = plans[-1][plans[-1].index("\n[") :] if "\n[" in plans[-1] else ""
    path = tmp_path / "race.toml"
    path.write_text(head.replace("[rivals]", "[rivals]\nplans = []") + rest, encoding="utf-8")
    assert refusal(path).startswith("rivals.plans must hold at least one plan")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00", "not a text file"),
        (b"", "not a season file of schema 1"),
        (b"a,b\n1,2\n", "not a TOML file ("),
        (b"schema = 1\n", "name is missing"),
        (b"schema = 1\ncars = 5\n", "name is missing"),
    ],
)
def test_foreign_file_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "race.toml"
    path.write_bytes(content)
    assert refusal(path).startswith(message)


def test_half_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "race.toml"
    text = SHIPPED.read_text(encoding="utf-8")
    path.write_text(text[: len(text) // 2], encoding="utf-8")
    refusal(path)


def test_absent_file_and_folder_are_named(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.toml").startswith("cannot be read (No such file or directory)")
    assert refusal(tmp_path).startswith("cannot be read (Is a directory)")


def test_unknown_race_lists_the_known_ones(tmp_path: Path) -> None:
    assert "bahrain-2023" in race_names()
    for name in ("atlantis-2023", "", "../season"):
        with pytest.raises(
            RsrlError, match=r"^unknown race .+; known races: .*bahrain.*, each with a season such as 20.*\(see `rsrl races`\)$"
        ):
            load_race(name)
    with pytest.raises(RsrlError, match=r"known races: none"):
        load_race("bahrain-2023", tmp_path)


def test_a_race_can_be_named_by_its_file(bahrain: RaceRecord) -> None:
    assert load_race(str(SHIPPED)) == bahrain


def test_find_car(bahrain: RaceRecord) -> None:
    assert bahrain.cars[find_car(bahrain, None)].driver == bahrain.default_driver
    assert bahrain.cars[find_car(bahrain, "ver")].driver == "VER"
    for driver in ("SEN", ""):
        with pytest.raises(RsrlError, match=rf"^unknown driver '{driver}' for bahrain-2023; who started: ALB, .*ZHO$"):
            find_car(bahrain, driver)
