"""Values that the options of `rsrl explain` accept, checked before anything heavy is imported."""

from pathlib import Path
from typing import Final

from rsrl.errors import RsrlError

METHODS: Final = ("what-if", "attribution", "tree", "counterfactual", "summary")
"""In the order of the output."""

LEVELS: Final = ("group", "feature", "event", "cell")
BACKGROUNDS: Final = ("lap-aligned", "average")
TARGETS: Final = {"stay": "no pit", "soft": "pit soft", "medium": "pit medium", "hard": "pit hard"}
NORMS: Final = ("l1", "l2", "l0")
CHECKS: Final = ("consistent", "last-lap", "simulated")


def parse_methods(text: str, has_lap: bool, whole_race: bool) -> tuple[str, ...]:
    """Methods of a list such as `what-if,tree`, in the order of METHODS; `all` means every possible method.

    Args:
        has_lap: a lap or a state is given.
        whole_race: something that needs no lap is asked for: the safety-car table, fitting a tree, or its page.

    Raises:
        RsrlError: an unknown method, or one that needs a lap when none is given.
    """
    words = {word.strip() for word in text.split(",") if word.strip()}
    if unknown := sorted(words - {*METHODS, "all"}):
        raise RsrlError(f"unknown --method {unknown[0]!r}; there are {', '.join(METHODS)}, and all")
    if not words:
        raise RsrlError(f"--method names nothing; there are {', '.join(METHODS)}, and all")
    wanted = METHODS if "all" in words else tuple(name for name in METHODS if name in words)
    if not has_lap:
        if whole_race and "all" in words:
            return ()
        if wanted != ("summary",):
            raise RsrlError("which lap? give --lap, or --state, a race state from a file; --method summary covers a whole race")
    return wanted


def check_options(level: str, background: str, target: str | None, norm: str, check: str) -> None:
    """Raise RsrlError for a value that an option does not accept; a background may be a file."""
    for option, value, known in (("--level", level, LEVELS), ("--norm", norm, NORMS), ("--check", check, CHECKS)):
        if value not in known:
            raise RsrlError(f"unknown {option} {value!r}; there are {', '.join(known)}")
    if target is not None and target not in TARGETS:
        raise RsrlError(f"unknown --target {target!r}; there are {', '.join(TARGETS)}")
    if background not in BACKGROUNDS and not Path(background).is_file():
        raise RsrlError(f"--background {background}: neither {' nor '.join(BACKGROUNDS)}, nor a file")
