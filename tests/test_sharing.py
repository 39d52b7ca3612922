"""Plants are shared: by threads, by forked and by fresh processes, by copies and pickles. Each of `PLANTS` is tried."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import orient_eye
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.motor import names
from orient_eye.plants import PLANTS, Plant, fixation, make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.plants.uncertain import uncertain
from orient_eye.statics import degrees_per_motor

Array = NDArray[np.float64]
Results = dict[str, Any]


def forms() -> dict[str, tuple[str, dict[str, Any]]]:
    """Every plant of the registry, as every switch and a rig make it."""
    found: dict[str, tuple[str, dict[str, Any]]] = {}
    for name, kind in PLANTS.items():
        switches: list[tuple[str, Any]] = [(option.name, True) for option in kind.options if option.type is bool]
        rigs: list[tuple[str, Any]] = [("rig", "prototype") for option in kind.options if option.name == "rig"]
        found |= {name: (name, {})} | {f"{name} {key}": (name, {key: value}) for key, value in [*switches, *rigs]}
    return found


FORMS = forms()
NAMES = [*FORMS, "lpf uncertain"]
IN_TURN = pytest.mark.parametrize("name", NAMES)


@cache
def used(name: str) -> Plant:
    """The plant of that name, which all tests share."""
    if name == "lpf uncertain":
        return uncertain(LinearPlant(), {"K": (1.4, 1.6), "w0": (15.0, 20.0)})
    kind, options = FORMS[name]
    return make_plant(kind, **options)


@cache
def alone(name: str, job: int) -> Results:
    """Results of one call after the other."""
    return results(used(name), job)


def batch(plant: Plant, job: int) -> PulseStep:
    """One of several, each of another size."""
    random, shape = np.random.default_rng(job), (1 + 7 * job % 4, len(plant.motors))
    reach = np.array([min(-motor.working[0], motor.working[1]) for motor in plant.motors])
    F, D = 0.2 * reach * random.uniform(-1, 1, (2, *shape))
    return PulseStep(F, random.uniform(25, 70, shape), D, random.uniform(8, 25, shape))


def results(plant: Plant, job: int) -> Results:
    """Whatever a plant is asked."""
    command = batch(plant, job)
    random = np.random.default_rng(job)
    written = plant.move(command.sample(plant.step_s, 40))
    told: Results = {"rates": plant.motor_rates(), "identity": repr(plant.identity())}
    told["pulse-step"] = plant.move(command, None, 0.06 + 0.01 * job, random).trajectory().orientation
    told |= {"orientation": written.trajectory().orientation, "elastics": written.trajectory().tension}
    told |= {"settling": written.measure(of="gaze").settling_time_s, "energy": written.energy()}
    orientation, every = plant.rest(command.D), names(plant.motors)
    told |= {"rest": orientation, "hold": plant.hold(orientation, every), "held": plant.held(orientation, every)}
    told["force"] = plant.force(orientation, command.D)
    if hasattr(plant, "tension"):
        told["tension"] = plant.tension(orientation, command.D)
    return told


def same(found: Results, expected: Results) -> None:
    """Bit for bit."""
    assert set(found) == set(expected)
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


JOBS = range(3)


@IN_TURN
def test_several_threads_share_a_plant(name: str) -> None:
    """They begin together, on a plant that nobody has used, so that its caches are filled by several at once."""
    plant, together = copy.deepcopy(used(name)), threading.Barrier(len(JOBS))
    expected = [alone(name, job) for job in JOBS]

    def work(job: int) -> list[Results]:
        together.wait(60)
        return [results(plant, job) for _ in range(2)]

    with ThreadPoolExecutor(len(JOBS)) as threads:
        for done, right in zip(threads.map(work, JOBS), expected, strict=True):
            for found in done:
                same(found, right)


@IN_TURN
def test_copies_are_the_plant(name: str) -> None:
    """Also what a plant knows of itself: its twin, and how lightly it takes doubt."""
    plant = used(name)
    lighter = copy.copy(plant)
    lighter.doubt = 1e-3
    assert plant.doubt != 1e-3
    for other in (copy.copy(lighter), copy.deepcopy(lighter), pickle.loads(pickle.dumps(lighter))):
        assert other.doubt == 1e-3
        assert other.motors == plant.motors
        assert (other.twin() is None) == (plant.twin() is None)
    other.doubt = plant.doubt
    same(results(other, 1), alone(name, 1))
    twin = plant.twin()
    if twin is not None:
        same(results(pickle.loads(pickle.dumps(twin)), 2), results(twin, 2))


# --- processes ------------------------------------------------------------------------------------


def finished(child: Callable[[], Any], seconds: float = 60) -> Any:
    """What a forked child finds out."""
    reads, writes = os.pipe()
    pid = os.fork()
    if not pid:
        code = 1
        try:
            os.close(reads)
            with os.fdopen(writes, "wb") as pipe:
                pickle.dump(child(), pipe)
            code = 0
        finally:
            os._exit(code)
    os.close(writes)
    alarm = threading.Timer(seconds, os.kill, (pid, signal.SIGKILL))
    alarm.start()
    with os.fdopen(reads, "rb") as pipe:
        told = pipe.read()
    status = os.waitpid(pid, 0)[1]
    alarm.cancel()
    assert status == 0, f"the forked child ended with {status}"
    return pickle.loads(told)


def test_a_forked_child_has_the_plants_of_its_parent() -> None:
    expected = {name: alone(name, 2) for name in NAMES}
    for name, told in finished(lambda: answer({each: used(each) for each in NAMES}, 2)).items():
        same(told, expected[name])
    for name in PLANTS:  # and the parent has them still
        same(results(used(name), 2), expected[name])


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_fork_while_other_threads_use_a_plant() -> None:
    """Whatever they hold at that moment."""
    over, two = threading.Event(), ("mujoco", "tavares")
    expected = {name: alone(name, 2) for name in two}

    def use(name: str) -> None:
        while not over.is_set():
            results(copy.copy(used(name)), 0)

    threads = [threading.Thread(target=use, args=(name,)) for name in two]
    for thread in threads:
        thread.start()
    try:
        for _ in range(3):
            time.sleep(0.02)
            for name, told in finished(lambda: answer({each: used(each) for each in two}, 2)).items():
                same(told, expected[name])
    finally:
        over.set()
        for thread in threads:
            thread.join()


LETS_GO = """
import gc, os, sys
import numpy as np
from orient_eye.plants import make_plant
plant = make_plant("mujoco", threads=2)
plant.move(np.zeros((3, 5, 3))).trajectory()
if os.fork():
    sys.exit(os.waitstatus_to_exitcode(os.wait()[1]))
if sys.argv[1] == "dropped":
    del plant
    gc.collect()
"""


@pytest.mark.parametrize("how", ["dropped", "kept"])
def test_a_forked_child_lets_go_of_a_plant(how: str) -> None:
    """One that it never used; or it has it still when it ends. The threads of its parent are not there to wait for."""
    subprocess.run([sys.executable, "-W", "ignore", "-c", LETS_GO, how], check=True, timeout=60)


def answer(plants: dict[str, Plant], job: int) -> dict[str, Results]:
    return {name: results(plant, job) for name, plant in plants.items()}


@pytest.mark.parametrize("method", ["spawn", "forkserver"])
def test_a_fresh_process_is_sent_the_plants(method: str) -> None:
    """Used ones, of other threads and caches than it has."""
    expected = {name: alone(name, 1) for name in PLANTS}
    with ProcessPoolExecutor(1, multiprocessing.get_context(method)) as pool:
        for name, told in pool.submit(answer, {name: used(name) for name in PLANTS}, 1).result(120).items():
            same(told, expected[name])


# --- what modules remember ------------------------------------------------------------------------


def test_fixations_are_remembered_by_what_a_plant_is() -> None:
    """Not by where it lies in memory: another plant may come to lie there."""
    light, heavy = TavaresPlant(), TavaresPlant(gravity=True)
    found = [fixation.Fixations.of(plant) for plant in (light, heavy, TavaresPlant(), copy.copy(heavy))]
    assert found[0] is found[2]
    assert found[1] is found[3]
    assert found[0] is not found[1]
    direction = np.array([[0.9, 0.3, np.sqrt(1 - 0.81 - 0.09)]])
    assert found[0].torsion(direction) != found[1].torsion(direction)


def test_fixations_solved_by_several_threads_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = make_plant("modal")
    expected = fixation.Fixations.of(plant)
    monkeypatch.setattr(fixation, "_SOLVED", {})
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: fixation.Fixations.of(plant), range(8)):
            assert found.limit_deg == expected.limit_deg
            np.testing.assert_array_equal(found.coefficients, expected.coefficients)


@pytest.mark.parametrize("threads", [1.5, -1, 10**9, True, "2", None, float("nan")])
@pytest.mark.parametrize("name", ["mujoco", "tavares", "viscous"])
def test_a_number_of_threads_that_is_none(name: str, threads: Any) -> None:
    with pytest.raises(InputError, match=r"threads must be a whole number from 0 to 1024, got .*; 0 is one a core"):
        make_plant(name, threads=threads)


def test_every_plant_says_that_it_is_safe() -> None:
    assert "safe" in (Plant.__doc__ or "").lower()
    assert "fork" in (Plant.__doc__ or "").lower()
    for name in NAMES:
        assert "Safe to share" in (type(used(name)).__doc__ or ""), name


def test_statics_keep_nothing_of_a_plant() -> None:
    plant = used("modal")
    np.testing.assert_array_equal(degrees_per_motor(plant), degrees_per_motor(copy.deepcopy(plant)))


def test_no_lock_of_all_instances_stands_between_threads_and_forks() -> None:
    """That of functools' cached properties, before Python 3.12."""
    source = Path(orient_eye.__file__).parent
    users = [f.name for f in source.rglob("*.py") if "from functools import cached_property" in f.read_text("utf-8")]
    assert users == ["cached.py"]
