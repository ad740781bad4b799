"""Ctrl-C is answered while the compiler runs."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rsrl.compile_watch import is_compiling

BUSY = """
import hashlib, signal, sys
from rsrl.cli.interrupts import answer_while_compiling
from rsrl.compile_watch import compilation_begins
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have started the tests with it ignored
answer_while_compiling()
if sys.argv[1] == "compiling":
    compilation_begins()
print("ready", file=sys.stderr, flush=True)
hashlib.pbkdf2_hmac("sha256", b"", b"", int(sys.argv[2]))  # like the compiler, gives way to other threads but not to signals
"""
NETWORK = """
import hashlib, signal, sys
from rsrl.agents.jax_setup import jax, jnp
from rsrl.cli.interrupts import answer_while_compiling
signal.signal(signal.SIGINT, signal.default_int_handler)
answer_while_compiling()

def compiling_takes_long(event, value, fun_name=None, **about):
    if event.endswith("backend_compile_duration") and fun_name and "slow_to_compile" in fun_name:
        # XLA is as deaf to signals as this, but how long it takes differs from machine to machine
        print("ready", file=sys.stderr, flush=True)
        hashlib.pbkdf2_hmac("sha256", b"", b"", 2000000000)

@jax.jit
def slow_to_compile(x):
    return jnp.tanh(x)

x = jnp.ones(3)
jax.monitoring.register_scalar_listener(compiling_takes_long)
slow_to_compile(x)
"""
SIMULATE = """
import signal, sys
from rsrl.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["rsrl", "simulate", "bahrain-2023", "--races", "1"]
raise SystemExit(main())
"""


def interrupted(arguments: list[str], sign: str, after_s: float = 0.3, **environment: str) -> tuple[int, str, float]:
    """Exit code, the rest of standard error, and seconds until the end of a process that gets a Ctrl-C after it has printed `sign`."""
    command = [sys.executable, "-c", *arguments]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ | environment) as process:
        assert process.stderr is not None
        lines: list[str] = []
        while not (lines and sign in lines[-1]):
            lines.append(process.stderr.readline())
            assert lines[-1], lines
        time.sleep(after_s)
        assert process.poll() is None
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, rest = process.communicate(timeout=120)
        return process.returncode, rest, time.monotonic() - begun


def test_ctrl_c_ends_a_process_that_compiles() -> None:
    code, rest, seconds = interrupted([BUSY, "compiling", "2000000000"], "ready")
    assert (code, rest) == (130, "rsrl: interrupted\n")
    assert seconds < 2.0


def test_ctrl_c_ends_a_process_in_which_xla_compiles() -> None:
    code, rest, seconds = interrupted([NETWORK], "ready")
    assert (code, rest) == (130, "rsrl: interrupted\n")
    assert seconds < 2.0


def test_xla_counts_as_compiling_only_while_it_compiles() -> None:
    from rsrl.agents.jax_setup import jax

    seen: list[bool] = []

    def see(event: str) -> None:
        if event.endswith("backend_compile_duration"):
            seen.append(is_compiling())

    jax.monitoring.register_scalar_listener(lambda event, value, **about: see(event))
    jax.monitoring.register_event_duration_secs_listener(lambda event, duration_secs, **about: see(event))
    jax.jit(lambda x: x + 1.5).lower(2.0).compile()
    assert seen == [True, False]
    assert not is_compiling()


def test_ctrl_c_is_left_to_the_program_otherwise() -> None:
    code, rest, _ = interrupted([BUSY, "working", "3000000"], "ready")
    assert code != 130
    assert rest.endswith("KeyboardInterrupt\n")


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [0.5, 9.0])
def test_ctrl_c_ends_the_first_run_within_two_seconds(tmp_path: Path, after_s: float) -> None:
    code, rest, seconds = interrupted([SIMULATE], "compiling the simulator (once", after_s, XDG_CACHE_HOME=str(tmp_path))
    assert (code, rest) == (130, "rsrl: interrupted\n")
    assert seconds < 2.0
