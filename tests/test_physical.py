"""Parameters of the MJCF from recordings: made by plant `tavares`, found again through MuJoCo."""

import functools
import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco import sysid
from numpy.typing import NDArray

from orient_eye.cli.sysid import Sysid
from orient_eye.cli.sysid_physical import physical
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model
from orient_eye.learning import evaluation
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.policy import Policy
from orient_eye.learning.training import train
from orient_eye.plants import make_plant
from orient_eye.resources import data_folder
from orient_eye.rig import Rig, RigMotor
from orient_eye.search.optimum import find_optimum
from orient_eye.state import State
from orient_eye.sysid.fitted_eye import replayed, write_eye
from orient_eye.sysid.physical import fit_physical, parameters
from orient_eye.sysid.physical_recordings import read_recordings

Array = NDArray[np.float64]
TRUE = {"stiffness_vertical": 14.0, "friction": 0.03, "rest_length_vertical": 0.36, "rest_length_horizontal": 0.24}
STEPS = ((0, 15, 0), (0, -8, 0), (10, 0, 10), (8, 0, -8))
NOISE_DEG = 0.1
LENGTHS = ("rest_length_horizontal", "rest_length_vertical")
installed = pytest.mark.skipif(not hasattr(sysid, "ParameterDict"), reason="needs the extra physical")


def changed_eye(path: Path, vertical: float = 14.0, friction: float = 0.03) -> str:
    """The thesis' eye with other numbers, by editing its text."""
    folder = data_folder("eye_mjcf")
    text = (folder / "eye3.xml").read_text(encoding="utf-8")
    for old, new in (
        ('stiffness="16.666666666666668"', f'stiffness="{vertical!r}"'),
        ('type="ball" damping="0.02"', f'type="ball" damping="{friction!r}"'),
        ('meshdir="meshes"', f'meshdir="{folder / "meshes"}"'),
    ):
        assert text.count(old) == 1
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return str(path)


def command(step: Sequence[float], samples: int = 801) -> Array:
    """A ramp of 30 ms after 20 ms, (1, samples, motors)."""
    return np.clip((np.arange(samples) - 20) / 30, 0, 1)[None, :, None] * np.array(step, dtype=float)


def record(
    folder: Path, eye: str, steps: Sequence[Sequence[float]], seed: int = 1, plant: str = "tavares"
) -> list[Path]:
    """Noisy recordings of an eye, with uneven rows and sensors with zeros of their own; the second in quaternions."""
    random, simulated, paths = np.random.default_rng(seed), make_plant(plant, eye=eye), []
    for i, step in enumerate(steps):
        motor = command(step)
        moved = simulated.move(motor, State(simulated.rest(motor[:, 0]), motor[:, 0])).trajectory()
        # Uneven, but with the corners of the ramp: between rows a motor is taken along a straight line.
        rows = np.unique([0, 20, 50, *random.choice(801, 90, replace=False)])
        table = {"t_s": moved.time[rows] + 3.0}
        table |= {f"tau{k + 1}_deg": motor[0, rows, k] for k in range(3) if step[k]}
        if i == 1:
            noisy = moved.orientation[0, rows] + np.deg2rad(NOISE_DEG) / 2 * random.standard_normal((len(rows), 4))
            noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
            table |= dict(zip(("q_w", "q_x", "q_y", "q_z"), noisy.T, strict=True))
        else:
            for name in ("yaw_deg", "pitch_deg", "roll_deg"):
                zero = random.uniform(-2, 2)
                table[name] = getattr(moved, name)[0, rows] + zero + NOISE_DEG * random.standard_normal(len(rows))
        paths.append(folder / f"step{i}.csv")
        np.savetxt(paths[-1], np.column_stack([*table.values()]), delimiter=",", header=",".join(table), comments="")
    return paths


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recorded")
    return record(folder, changed_eye(folder / "changed.xml"), STEPS)


@installed
def test_a_changed_eye_is_found_again(recorded: list[Path]) -> None:
    fit = fit_physical(read_recordings(recorded), frozen=("stiffness_horizontal",))
    assert {e.parameter.name for e in fit.estimates} == set(TRUE)
    assert fit.frozen == {"stiffness_horizontal": 25.0}
    for name, value in TRUE.items():
        low, high = fit[name].interval
        assert low < value < high, f"{name} = {fit[name]}"
    assert fit["stiffness_vertical"].half_width < 0.4
    assert fit["friction"].half_width < 0.0008
    assert fit.rms_deg == pytest.approx(NOISE_DEG, rel=0.1)
    assert fit.condition < 10
    assert [h.name for h in fit.held_out] == [path.name for path in recorded]
    assert max(h.rms_deg for h in fit.held_out) < 3 * NOISE_DEG
    assert not fit.warnings


@installed
@pytest.mark.parametrize("steps", [[0], [2], [0, 1]])
def test_one_axis_tells_stiffness_and_friction_by_default(recorded: list[Path], steps: list[int]) -> None:
    fit = fit_physical(read_recordings([recorded[i] for i in steps]))
    assert {e.parameter.name for e in fit.estimates} == {"stiffness_vertical", "friction"}
    for e in fit.estimates:
        low, high = e.interval
        assert low < TRUE[e.parameter.name] < high
    assert not fit.undetermined


@installed
def test_angles_tell_ratios_to_the_friction_only(recorded: list[Path]) -> None:
    fit = fit_physical(read_recordings(recorded), frozen=("friction", *LENGTHS))
    told = fit.frozen["friction"] / TRUE["friction"]
    assert fit["stiffness_horizontal"].value == pytest.approx(25 * told, rel=0.01)
    assert fit["stiffness_vertical"].value == pytest.approx(14 * told, rel=0.02)
    assert fit.rms_deg == pytest.approx(NOISE_DEG, rel=0.1)


@installed
@pytest.mark.parametrize("eye", ["thesis", "eve_v3"])
def test_the_written_file_needs_no_other_and_moves_as_fitted(tmp_path: Path, eye: str) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    true = changed_eye(tmp_path / "true.xml") if eye == "thesis" else "eve_v3"
    recordings = read_recordings(record(tmp_path, true, [(0, 15, 0), (10, 0, 10)]), eye)
    fit = fit_physical(recordings, eye)
    assert write_eye(fit, tmp_path / "fitted.xml") == []
    written = str(shutil.move(tmp_path / "fitted.xml", elsewhere / "fitted.xml"))
    assert "file=" not in Path(written).read_text(encoding="utf-8")

    motor = command((12, 20, -9))
    moved = make_plant("mujoco", eye=written).move(motor).trajectory()
    if eye == "thesis":
        by_hand = changed_eye(tmp_path / "by_hand.xml", fit["stiffness_vertical"].value, fit["friction"].value)
        expected = make_plant("mujoco", eye=by_hand).move(motor).trajectory()
        np.testing.assert_allclose(moved.yaw_deg, expected.yaw_deg, atol=1e-3)
        np.testing.assert_allclose(moved.pitch_deg, expected.pitch_deg, atol=1e-3)
    measured = make_plant("mujoco", eye=true).move(motor).trajectory()
    np.testing.assert_allclose(moved.yaw_deg, measured.yaw_deg, atol=0.4)

    drawn, shipped = corners(build_model(written)), corners(build_model(eye))
    for mine, theirs in zip(drawn, shipped, strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-6)


def corners(model: mujoco.MjModel) -> list[Array]:
    """Where the corners of all shapes stand [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = []
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
        found.append(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return found


@installed
def test_a_fitted_eye_is_fitted_again(tmp_path: Path) -> None:
    recordings = read_recordings(record(tmp_path, changed_eye(tmp_path / "true.xml"), [(12, 15, 8)]))
    write_eye(fit_physical(recordings), tmp_path / "once.xml")
    again = fit_physical(recordings, str(tmp_path / "once.xml"))
    for name, value in parameters(str(tmp_path / "once.xml")).items():
        assert again.values[name.name] == pytest.approx(value, rel=1e-3)


@installed
def test_what_is_not_determined_is_named_and_not_written(tmp_path: Path, recorded: list[Path]) -> None:
    vertical = [recorded[2]]  # yaw hardly moves
    with pytest.raises(InputError, match=r"do not determine .*rest_length_horizontal.*no eye was written"):
        physical(vertical, "thesis", ("friction",), tmp_path / "run")
    assert not (tmp_path / "run" / "eye.xml").exists()
    assert (tmp_path / "run" / "recordings.png").exists()
    assert (tmp_path / "run" / "recording.rrd").exists()
    told = json.loads((tmp_path / "run" / "physical.json").read_text())
    assert told["model"] is None
    assert told["fitted"]["rest_length_horizontal"]["undetermined"]
    assert told["condition"] > 100
    assert any("rest_length_horizontal cannot be told" in warning for warning in told["warnings"])
    assert any("one recording only" in warning for warning in told["warnings"])
    forced = physical(vertical, "thesis", ("friction",), tmp_path / "forced", force=True)
    make_plant("mujoco", eye=forced["model"])


@installed
def test_a_parameter_at_its_bound_is_named(tmp_path: Path) -> None:
    stiff = changed_eye(tmp_path / "stiff.xml", vertical=240.0, friction=0.02)
    paths = record(tmp_path, stiff, [(10, 0, 10)], plant="mujoco")
    fit = fit_physical(read_recordings(paths), frozen=("stiffness_horizontal", "friction", *LENGTHS))
    assert fit.at_bound == ("stiffness_vertical",)
    assert any("sits on its bound" in warning for warning in fit.warnings)


@pytest.mark.parametrize("eye", ["thesis", "eve_v3"])
def test_bounds_keep_away_from_divergence(eye: str) -> None:
    model = build_model(eye, visual=False)
    highest = next(p.high for p in parameters(eye) if p.name == "friction")
    assert model.opt.timestep * highest / model.body("eye").inertia.min() < 2


@installed
def test_the_command_writes_numbers_and_an_eye(tmp_path: Path, recorded: list[Path]) -> None:
    result = physical(recorded, "thesis", None, tmp_path / "run")
    assert json.loads((tmp_path / "run" / "physical.json").read_text()) == result
    assert result["files"] == ["recordings.png", "recording.rrd"]
    assert all((tmp_path / "run" / name).stat().st_size > 10_000 for name in result["files"])
    assert result["held_out_rms_deg"] < 3 * NOISE_DEG
    assert make_plant("mujoco", eye=result["model"]).model.dof_damping[0] == result["fitted"]["friction"]["value"]


@installed
@pytest.mark.usefixtures("plain")
def test_the_fitted_eye_is_learned_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = read_recordings(record(tmp_path, changed_eye(tmp_path / "true.xml"), [(0, 15, 0)]))
    eye = str(tmp_path / "eye.xml")
    write_eye(fit_physical(recordings), eye)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    short = functools.partial(find_optimum, random=np.random.default_rng(0), effort=0.1)
    monkeypatch.setattr(evaluation, "searched_optimum", lambda *saccades, **_: short(*saccades))
    options = {"eye": eye}
    size = {"updates": 3, "saccades_per_update": 4, "warmup": 8, "batch_size": 8, "evaluation_pairs": 1}
    train(TrainConfig("mujoco", options, **size), tmp_path / "run", quiet=True)
    plant = make_plant("mujoco", **options).identity()
    assert Policy.load(tmp_path / "run").task().plant.identity() == plant != make_plant("mujoco").identity()


@installed
def test_what_is_drawn_is_what_was_measured_and_what_the_written_eye_does(tmp_path: Path, recorded: list[Path]) -> None:
    """The measured angles without the zeros of their sensors; and the file moved by the plant as the motors moved."""
    recordings = read_recordings(recorded[:3])
    fit = fit_physical(recordings)
    write_eye(fit, tmp_path / "eye.xml")
    plant = make_plant("mujoco", eye=str(tmp_path / "eye.xml"))
    measured, fitted = replayed(fit, recordings)
    assert measured.motor_names == fitted.motor_names == ("motor1", "motor2", "motor3")
    for i, recording in enumerate(recordings):
        time = recording.time - recording.time[0]
        grid = np.arange(0, time[-1], 0.001)
        motor = np.stack([np.interp(grid, time, column) for column in recording.motor.T], axis=-1)[None]
        told = plant.move(motor, State(plant.rest(motor[:, 0]), motor[:, 0])).trajectory()
        shown = fitted.time < time[-1] - 0.005
        for k, name in enumerate(("yaw_deg", "pitch_deg", "roll_deg")):
            right = np.interp(fitted.time[shown], told.time, getattr(told, name)[0])
            np.testing.assert_allclose(getattr(fitted, name)[i, shown], right, atol=0.02)
            rows = np.interp(time, grid, getattr(told, name)[0])
            zero = np.mean(recording.angles[:, k] - rows)
            np.testing.assert_allclose(rows - recording.angles[:, k] + zero, fit.residuals[i][:, k], atol=0.02)
            nearest = np.interp(time, measured.time, getattr(measured, name)[i]) - (recording.angles[:, k] - zero)
            assert np.sqrt(np.mean(nearest**2)) < 1.5 * NOISE_DEG  # a noisy angle, drawn at other times


def test_a_rig_tells_its_motors_in_counts(tmp_path: Path, recorded: list[Path]) -> None:
    counts = RigMotor("motor2", "counts", 10.0, 512.0, -1)
    text = recorded[0].read_text().replace("tau2_deg", "motor2_counts").splitlines()
    rows = [row.split(",") for row in text[1:]]
    for row in rows:
        row[1] = repr(512.0 - 10.0 * float(row[1]))
    path = tmp_path / "counts.csv"
    path.write_text("\n".join([text[0], *(",".join(row) for row in rows)]) + "\n")
    (told,) = read_recordings([path], rig=Rig("mine", (counts,), {"yaw": {"motor2": 1.0}}))
    np.testing.assert_allclose(told.motor, read_recordings(recorded[:1])[0].motor, atol=1e-9)
    with pytest.raises(InputError, match="tau2_deg"):
        read_recordings([path])


def test_an_eye_wound_up_by_spindles_is_refused(tmp_path: Path) -> None:
    six = make_plant("tavares", eye="six")
    rest = np.array([motor.rest for motor in six.motors])
    assert (rest > 50).all()
    rows = [f"{0.01 * k},{rest[1] + min(k, 5)},{0.5 * min(k, 5)}" for k in range(20)]
    table = tmp_path / "mr.csv"
    table.write_text("\n".join(["t_s,MR_deg,yaw_deg", *rows]), encoding="utf-8")
    (read,) = read_recordings([table], "six")
    np.testing.assert_allclose(read.motor[:, [0, 2, 3, 4, 5]], np.tile(rest[[0, 2, 3, 4, 5]], (20, 1)))
    with pytest.raises(InputError, match=r"eye 'six' is wound up by spindles, IR, MR, SR, LR, IO, SO.*another --eye"):
        Sysid(physical=True, plant_options={"eye": "six"}, recording=(table,), out=tmp_path / "run").run()
    assert not (tmp_path / "run").exists()


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, recorded: list[Path]) -> None:
    monkeypatch.delattr(sysid, "ParameterDict", raising=False)
    with pytest.raises(InputError, match=r"pip install 'orient-eye\[physical\]'"):
        fit_physical(read_recordings(recorded))


@installed
@pytest.mark.parametrize(
    ("frozen", "message"),
    [
        ((), "only ratios of stiffness to friction"),
        (("rest_length_vertical",), "only ratios of stiffness to friction"),
        (("stiffness_diagonal",), "no parameter 'stiffness_diagonal'; it has stiffness_vertical"),
        (tuple(p.name for p in parameters("thesis")), "nothing is left to fit"),
    ],
)
def test_what_cannot_be_frozen(recorded: list[Path], frozen: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_physical(read_recordings(recorded), frozen=frozen)


@pytest.mark.parametrize(
    ("header", "row", "message"),
    [
        ("t_s,yaw_deg", "{t},{t}", "no motor of this eye moves"),
        ("t_s,tau2_deg,eye_deg", "{t},{t},{t}", "no angle of the eye"),
        ("t_s,tau2_deg,q_w,q_x,q_y,q_z", "{t},{t},2,0,0,0", "unit quaternions"),
        ("tau2_deg,yaw_deg", "{t},{t}", "t_s"),
    ],
)
def test_tables_that_tell_nothing(tmp_path: Path, header: str, row: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text("\n".join([header, *(row.format(t=t / 100) for t in range(20))]) + "\n")
    with pytest.raises(InputError, match=message):
        read_recordings([path])
    path.write_text("\n".join([header, row.format(t=0)]) + "\n")
    with pytest.raises(InputError):
        read_recordings([path])


def test_a_file_named_twice(recorded: list[Path]) -> None:
    with pytest.raises(InputError, match="named twice"):
        read_recordings([recorded[0], recorded[0]])
