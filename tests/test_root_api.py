"""`import rsrl`: quick, lazy and typed; its functions give what the commands give, and their examples run."""

import ast
import doctest
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import rsrl
from rsrl import api
from rsrl.cli import main
from rsrl.cli.leaderboard import DEFAULT_STRATEGISTS

ROOT = Path(rsrl.__file__)
FUNCTIONS = ("simulate", "plan", "load_policy", "evaluate", "explain", "make_env")
MOST_MS = 50.0


def in_new_process(code: str) -> str:
    """What a program prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_importing_is_quick_and_imports_nothing_heavy() -> None:
    code = "import sys, time; t = time.perf_counter(); import rsrl; print(1000 * (time.perf_counter() - t)); print(*sys.modules)"
    times_ms = []
    for _ in range(3):  # the quickest of three, since other tests may be using the processor
        took, modules = in_new_process(code).splitlines()
        times_ms.append(float(took))
        assert not {"numpy", "numba", "jax", "gymnasium", "polars", "matplotlib"} & set(modules.split())
    assert min(times_ms) < MOST_MS


def test_every_public_name_is_there_and_listed_for_editors_and_type_checkers() -> None:
    for name in rsrl.__all__:
        assert getattr(rsrl, name).__doc__, name
    assert set(rsrl.__all__) <= set(dir(rsrl))
    block = next(n for n in ast.parse(ROOT.read_text("utf-8")).body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    assert {alias.name for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names} == set(rsrl.__all__)
    assert in_new_process("import rsrl; print(*dir(rsrl))").split() == sorted(in_new_process("import rsrl; print(*dir(rsrl))").split())


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'simulte'.*simulate"):
        rsrl.simulte  # type: ignore[attr-defined]  # noqa: B018


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_of_each_function_runs(name: str) -> None:
    function = getattr(rsrl, name)
    examples = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    assert [bool(one.examples) for one in examples] == [True]
    said: list[str] = []
    failed, tried = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(examples[0], out=said.append)
    assert tried
    assert not failed, "".join(said)


def command_json(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    """What a command prints with --json."""
    assert main([*words, "--json"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def test_simulate_gives_what_the_command_gives(capsys: pytest.CaptureFixture[str]) -> None:
    said = command_json(capsys, "simulate", "bahrain-2023", "--races", "60", "--seed", "3", "--driver", "ALO", "--plan", "S-H@14-S@36")
    found = rsrl.simulate("bahrain-2023", races=60, seed=3, driver="ALO", plan="S-H@14-S@36")
    assert [vars(car) for car in found.cars] == said["cars"]
    assert found.car("alo") == next(car for car in found.cars if car.driver == "ALO")
    assert found.positions("ALO").mean() == found.car("ALO").mean_position
    assert found.to_frame()["driver"].to_list() == [car["driver"] for car in said["cars"]]
    assert rsrl.simulate("bahrain-2023", races=60, seed=3, driver="ALO", plan=rsrl.Plan.parse("S-H@14-S@36")).cars == found.cars


@pytest.mark.slow
def test_plan_gives_what_the_command_gives(capsys: pytest.CaptureFixture[str]) -> None:
    said = command_json(capsys, "plan", "bahrain-2023", "--races", "600", "--driver", "ALO", "--start", "S", "--seed", "2")
    found = rsrl.plan("bahrain-2023", races=600, driver="ALO", start="S", seed=2)
    shown = found.by_compounds[: len(said["plans"])]
    assert [str(one.plan) for one in shown] == [row["plan"] for row in said["plans"]]
    assert [one.mean_position for one in shown] == [row["mean_position"] for row in said["plans"]]


def test_evaluate_gives_what_the_command_gives(capsys: pytest.CaptureFixture[str]) -> None:
    said = command_json(
        capsys, "evaluate", "all", "--race", "bahrain-2023", "--driver", "HAM", "--races", "20", "--seed", "5",
        "--strategists", "heuristic,bahrain-2023",
    )  # fmt: skip
    rows = rsrl.evaluate("bahrain-2023", driver="HAM", races=20, seed=5, strategists=["heuristic", "bahrain-2023"])
    assert len(rows) == len(said["rows"]) == 3
    for row, told in zip(rows, said["rows"], strict=True):
        for name, value in told.items():
            found = getattr(row, name)
            if name != "decision_ms":
                assert (list(found) if isinstance(found, tuple) else found) == value, name


def test_evaluate_and_the_command_compare_with_the_same_strategists() -> None:
    assert ",".join(api.DEFAULT_STRATEGISTS) == DEFAULT_STRATEGISTS


@pytest.mark.slow
def test_explain_gives_what_the_command_gives(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("explain", "all", "--race", "bahrain-2023", "--driver", "HAM", "--lap", "12", "--seed", "1", "--races", "40")
    said = command_json(capsys, *words, "--method", "what-if,attribution,tree,counterfactual")
    by_method = {one["method"]: one for one in reversed(said["explanations"])}
    for method in ("what-if", "attribution", "tree", "counterfactual"):
        found = rsrl.explain("bahrain-2023", driver="HAM", lap=12, seed=1, races=40, method=method)
        assert json.loads(found.to_json())["rows"] == by_method[method]["rows"]
    said = command_json(capsys, *words[:6], "--method", "summary", "--seed", "1")
    found = rsrl.explain("bahrain-2023", driver="HAM", seed=1, method="summary")
    assert list(found.sentences) == said["explanations"][0]["sentences"]


def stay_out(observation: NDArray[np.float32], mask: NDArray[np.int8]) -> int:
    """The policy of the least effort."""
    return 0 if mask[0] else int(np.flatnonzero(mask)[-1])


def test_a_function_is_a_policy() -> None:
    rows = rsrl.evaluate("bahrain-2023", stay_out, driver="HAM", races=6, strategists=["heuristic"])
    assert {row.strategist for row in rows} == {"stay_out", "heuristic"}
    found = rsrl.explain("bahrain-2023", model=stay_out, driver="HAM", lap=10, seed=1, races=10)
    assert found.decision.call == "no pit"
    with pytest.raises(rsrl.RsrlError, match=r"stay_out: gives calls without values, which tree needs; .* what-if"):
        rsrl.explain("bahrain-2023", model=stay_out, lap=10, method="tree")


def test_a_race_is_a_name_a_path_or_a_record(bahrain: Any) -> None:
    path = ROOT.parent / "season" / "races" / "bahrain-2023.toml"
    cars = [rsrl.simulate(race, races=5).cars for race in ("bahrain-2023", path, bahrain)]
    assert cars[0] == cars[1] == cars[2]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rsrl.simulate("atlantis-2023"), "atlantis-2023"),
        (lambda: rsrl.simulate("bahrain-2023", driver="XXX"), "XXX"),
        (lambda: rsrl.simulate("bahrain-2023", plan="S-S@14"), "two compounds"),
        (lambda: rsrl.plan("bahrain-2023", start="X"), "start is 'X'; tyres are S, M, H"),
        (lambda: rsrl.load_policy("nobody"), "nobody"),
        (lambda: rsrl.evaluate("bahrain-2023", races=0, strategists=[]), "races is 0"),
        (lambda: rsrl.evaluate("bahrain-2023", strategists="dp,oracle"), "unknown strategist 'oracle'; there are fixed"),
        (lambda: rsrl.explain("bahrain-2023", lap=99), "lap 99 is outside"),
        (lambda: rsrl.explain("bahrain-2023"), "which lap"),
        (lambda: rsrl.explain("bahrain-2023", lap=9, method="why"), "unknown method 'why'; there are what-if"),  # type: ignore[arg-type]
        (lambda: rsrl.make_env("bahrain-2023", feature_set="half"), "unknown feature set"),
    ],
)
def test_bad_input_is_one_clear_line(call: Any, message: str) -> None:
    with pytest.raises(rsrl.RsrlError, match=message):
        call()


def test_the_environment_is_known_to_gymnasium_whichever_is_imported_first() -> None:
    make = "print(gymnasium.spec('rsrl/Race-v0').id)"
    for imports in ("import rsrl, gymnasium", "import gymnasium, rsrl", "import rsrl.season, gymnasium.spaces, gymnasium"):
        assert in_new_process(f"{imports}; {make}") == "rsrl/Race-v0"


@pytest.mark.parametrize("before", ["", "import rsrl; "])
def test_the_environment_is_made_without_an_import_by_naming_the_package(before: str) -> None:
    code = f"{before}import gymnasium; print(gymnasium.make('rsrl:rsrl/Race-v0').reset(seed=1)[0].shape)"
    assert in_new_process(code) == "(85,)"
    vector = f"{before}import gymnasium; print(gymnasium.make_vec('rsrl:rsrl/Race-v0', num_envs=3).reset(seed=1)[0].shape)"
    assert in_new_process(vector) == "(3, 85)"
