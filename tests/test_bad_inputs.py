"""Bad input, and what is said of it: one table for the command line, one for Python.

Every row ends with exit code 2 (or `InputError`) and its message: what was got, what is allowed or what to do; without
a traceback, and without a file or folder left.
"""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orient_eye as oe
from bad_files import write_pool
from orient_eye.cli import COMMANDS, main
from orient_eye.task.cases import Case
from orient_eye.task.solved_weights import ChosenSaccade, Steps

RANDOM = np.random.default_rng(0)
_ALL_SIX = "t_s,IR_deg,MR_deg,SR_deg,LR_deg,IO_deg,SO_deg\n"
SIX = {
    "six.csv": "t_s,MR_deg\n0,56.2\n0.3,60\n",
    "six_slack.csv": f"{_ALL_SIX}0,0,0,0,0,0,0\n0.3,57,57,57,57,57,57\n",
    "six_away.csv": f"{_ALL_SIX}0,200,200,200,200,200,200\n0.3,57,57,57,57,57,57\n",
    "six_far.csv": "t_s,MR_deg\n0,56.2\n0.3,400\n",
    "six_loose.csv": "t_s,MR_deg\n0,56.2\n0,-60\n0.3,56.2\n",
}
NAN, INF, HUGE = float("nan"), float("inf"), 10**400
LINES: list[tuple[str, str]] = [
    # what a command is
    ("nosuch", "Unrecognized options: nosuch .* Available subcommands: simulate"),
    ("--plant lpf", "--plant"),
    ("models --all", "Unrecognized options: --all"),
    # simulate
    ("simulate", "--motor"),
    ("simulate --motor nosuch.csv", "cannot read nosuch.csv"),
    ("simulate --motor folder", "cannot read folder"),
    ("simulate --motor garbage.csv", "cannot read garbage.csv"),
    ("simulate --motor empty.csv", "empty.csv is empty; it needs a header"),
    ("simulate --motor header.csv", "no rows of numbers below its header"),
    ("simulate --motor cut.csv", "cut.csv, line 3: 1 cells, but there are 2 columns"),
    ("simulate --motor words.csv", "words.csv, line 3: tau2_deg is 'ten', not a number"),
    ("simulate --motor nan.csv", "nan.csv, line 3: tau2_deg is not a finite number"),
    ("simulate --motor back.csv", "back.csv, line 4: time must rise from row to row"),
    ("simulate --motor step.csv --plant lpf", "cannot be commanded by motor_deg, eye_deg; its columns are t_s"),
    ("simulate --motor sent_ms.csv --plant lpf", "500 rows are 1 s apart .* are these ms.* divide by 1000"),
    ("simulate --motor sent_us.csv --plant lpf", "a command lasts up to one hour, this one .* s; t_s is in s"),
    ("simulate --motor far.csv", "mechanical range"),
    ("simulate --motor command.csv --horizon 0", "--horizon must be a number from 0.001 to 3600 s, got 0"),
    ("simulate --motor command.csv --horizon -1", "horizon .* got -1"),
    ("simulate --motor command.csv --horizon nan", "horizon .* got nan"),
    ("simulate --motor command.csv --horizon 1e308", "horizon .* got 1e.308"),
    ("simulate --motor command.csv --horizon '5 s'", "--horizon: no type matching FLOAT .* from .'5 s'"),
    ("simulate --motor command.csv --plant nosuch", "invalid choice 'nosuch' for argument '--plant'"),
    ("simulate --motor command.csv --surrogate thesis", "--surrogate does nothing on plant 'mujoco'"),
    ("simulate --motor command.csv --eye nosuch", "unknown eye 'nosuch'"),
    ("simulate --motor command.csv --eye garbage.xml", "garbage.xml"),
    ("simulate --motor command.csv --rig nosuch.toml", "nosuch.toml is no rig: there is no such file"),
    ("simulate --motor command.csv --rig command.csv", "command.csv"),
    ("simulate --motor command.csv --plant lpf --surrogate command.csv", "command.csv"),
    ("simulate --motor command.csv --plant lpf --out folder", "folder exists and is not an empty folder"),
    ("simulate --motor command.csv --plant lpf --out command.csv/out", "command.csv/out"),
    ("simulate --motor command.csv --eye six", "cannot be commanded by tau2_deg; its columns are t_s, IR_deg, MR_deg"),
    ("simulate --motor six_slack.csv --eye six",
     "six_slack.csv, first row: slack cables do not hold the eye: IR, MR, SR, LR, IO, SO; .* at ease .* IR 57.8, MR"),
    ("simulate --motor six_away.csv --eye six --plant tavares",
     "six_away.csv, first row: the eye would not stay near straight ahead, it turns away by .* deg; wind .* less"),
    ("simulate --motor six_far.csv --eye six", "sends MR to .* mechanical range is -57 to 344 deg"),
    ("simulate --motor six_loose.csv --eye six", "sends MR to -60.0 deg .* mechanical range is -57 to 344 deg"),
    ("simulate --motor six.csv", "cannot be commanded by MR_deg; its columns are t_s, tau1_deg, tau2_deg, tau3_deg"),
    ("simulate --motor six.csv --eye six --pretension 3", "the eye has no pretension 3: choose one of 1, 2"),
    ("simulate --motor six.csv --eye six --pretension nan", "pretension must be a number, got nan; choose one of 1, 2"),
    ("simulate --motor command.csv --pretension 1", "no pretension 1: its motors rest at 0; leave the pretension out"),
    ("simulate --motor command.csv --plant lpf --pretension 1", "--pretension does nothing on plant 'lpf'"),
    # sysid
    ("sysid --plant lpf --amplitudes", "no step amplitude given; name at least one"),
    ("sysid --plant lpf --amplitudes 0", "a step of 0 deg shows nothing"),
    ("sysid --plant lpf --amplitudes 1e-300", "a step of 1e-300 deg shows nothing"),
    ("sysid --plant lpf --amplitudes 1e308", "amplitude of a step must be a number from -360 to 360 deg, got 1e.308"),
    ("sysid --plant lpf --amplitudes nan", "amplitude of a step .* got nan"),
    ("sysid --plant lpf --amplitudes 5 5", "an amplitude is named twice"),
    ("sysid --plant lpf --amplitudes '5 deg'", "'5 deg'"),
    ("sysid --plant lpf --amplitudes 5 --held-out 1e308", "amplitude of a step .* got 1e.308"),
    ("sysid --plant mujoco --amplitudes 90", "from -80 to 80 deg, got 90; that is the mechanical range of motor2"),
    ("sysid --plant lpf --motor motor9", "motor9"),
    ("sysid --plant lpf --axis pitch", "no motor of plant 'lpf' turns the eye in pitch"),
    ("sysid --plant lpf --model third_order", "--model"),
    ("sysid --plant lpf --until 1", "--until is for recordings"),
    ("sysid --plant lpf --seed 1", "--seed is for --all-motors"),
    ("sysid --plant lpf --frozen stiffness", "--frozen is for --physical"),
    ("sysid --plant lpf --all-motors", "--all-motors needs three motors or more and three axes"),
    ("sysid --plant tavares --all-motors --seed -1", "--seed must be a whole number of at least 0, got -1"),
    ("sysid --plant tavares --all-motors --seed 1.5", "--seed"),
    ("sysid --plant tavares --all-motors --amplitudes 5", "--amplitudes says nothing to --all-motors"),
    ("sysid --recording", "--recording names no file"),
    ("sysid --recording nosuch.csv", "nosuch.csv"),
    ("sysid --recording step.csv step.csv", "step.csv is named twice"),
    ("sysid --recording step.csv --amplitudes 5", "--amplitudes is for a plant"),
    ("sysid --recording step.csv --until nan", "0 rows until nan s; at least 8 are needed"),
    ("sysid --recording step.csv --until -1", "0 rows until -1 s; at least 8 are needed"),
    ("sysid --recording step_rad.csv", "are these radians.* multiply by 57.29578"),
    ("sysid --recording step_ms.csv", "are these ms.* divide by 1000"),
    ("sysid --recording step_far.csv --force", "nothing turns by more than 1e.06 deg"),
    ("sysid --recording still.csv", "the eye does not move"),
    ("sysid --recording command.csv", "a step response needs at least 8"),
    ("sysid --recording sent.csv", "no angle of the eye"),
    ("sysid --plan", "--plan needs the rig"),
    ("sysid --plan --rig prototype --axis roll", "turns yaw, pitch, not roll"),
    ("sysid --plan --rig prototype --axis yaw --recording step.csv", "leave --recording out"),
    ("sysid --physical", "--physical fits an eye to recordings; name them"),
    # train and view
    ("train --updates 0 --plant lpf", "updates"),
    ("train --updates 1.5", "--updates"),
    ("train --batch-size 10000000000000", "batch size|batch_size"),
    ("sweep --seed", "seed names no value; give at least one"),
    ("sweep --seed 0 0", "seed names 0 twice"),
    ("sweep --seed 0 x", "--seed: no type matching"),
    ("sweep --nosuch 1", "Unrecognized options: --nosuch"),
    ("sweep --case 1 9", "invalid choice '9' for argument '--case'"),
    ("sweep --updates 8 0", "run updates0: updates must be a whole number from 1"),
    ("sweep --seed 0 1 --eye thesis", "--eye does nothing on plant 'lpf'"),
    ("sweep --seed 0 1 --from nosuch", "nosuch is no policy"),
    ("sweep --seed 0 1 --jobs 0", "runs at a time must be a whole number from 1 to 1024, got 0"),
    ("sweep --seed 0 1 --checkpoint-every nan", "checkpoint"),
    ("sweep --seed 0 1 --out folder", "folder exists and is not an empty folder"),
    ("sweep --seed 0 1 --out command.csv", "command.csv"),
    ("sweep nosuch.toml", "cannot read nosuch.toml"),
    ("sweep command.csv", "cannot read command.csv: .*give a TOML file"),
    ("sweep command.csv --seed 1", "not in both; leave seed out"),
    ("sweep --resume nosuch", "cannot read nosuch/sweep.json"),
    ("sweep --resume folder", "cannot read folder/sweep.json: .* no folder of a sweep"),
    ("sweep --resume folder --seed 1", "leave the other options out"),
    ("sweep --seed 0 1 --engine nosuch", "invalid choice 'nosuch' for argument '--engine'"),
    ("sweep --seed 0 1 --address auto", "the address 'auto' is of a cluster, add --engine ray, or leave it out"),
    ("report --figures 9.9", "unknown figure '9.9'"),
    ("report --pairs 0", "pairs must be a whole number"),
    ("report nosuch", "nosuch is no policy"),
    ("weights --like 500 5 20 2", "give --human too"),
    ("weights --human --like 500 5", "takes four numbers"),
    ("weights --human --like nan 5 20 2", "V0 of --like must be"),
    ("weights --human --pulse 1", "leave --pulse out"),
    ("train --weights 0 0 0 0", "weights"),
    ("train --weights 1 nan 1 1", "weight"),
    ("train --checkpoint-every nan", "checkpoint"),
    ("train --resume nosuch", "nosuch"),
    ("train --resume folder --updates 3", "leave the other options out"),
    ("view nosuch.rrd", "nosuch.rrd"),
    ("view command.csv", "command.csv"),
    # predict, evaluate, export
    ("predict", "POLICY"),
    ("predict nosuch --target 5", "nosuch is no policy"),
    ("predict garbage.csv --target 5", "garbage.csv is no policy"),
    ("predict lpf-1", "name a saccade by --start and --target"),
    ("predict lpf-1 --target nan", "target at nan deg"),
    ("predict lpf-1 --target 1e308", r"target at 1e\+308 deg: saccades are learned between -35.0 and 35.0"),
    ("predict lpf-1 --target 36", "between -35.0 and 35.0 deg of yaw; choose an angle in this range"),
    ("predict lpf-1 --target 5 5", r"--target takes YAW \[deg\]: as many numbers, not 2"),
    ("predict lpf-1 --target '5 deg'", "'5 deg'"),
    ("predict tavares-gaze --target 5", r"--target takes YAW \[deg\], PITCH \[deg\]: as many numbers, not 1"),
    ("predict lpf-1 --pairs pairs.csv --target 5", "give --pairs, or --start and --target, not both"),
    ("predict lpf-1 --pairs pairs_far.csv", "pairs_far.csv, line 4: target at 500 deg"),
    ("predict lpf-1 --pairs pairs_nan.csv", "pairs_nan.csv, line 3: start_yaw_deg is not a finite number"),
    ("predict lpf-1 --pairs step.csv", "no column start_yaw_deg"),
    ("predict lpf-1 --pairs pairs.csv --out pairs.csv", "--out and --pairs name the same file"),
    ("predict lpf-1 --target 5 --command x.csv --out x.csv", "--out and --command name the same file, x.csv"),
    ("predict lpf-1 --pairs pairs.csv --command x.csv", "--command writes the motor command of one saccade"),
    ("predict lpf-1 --target 5 --commands folder", "--commands folder is not an empty folder"),
    ("predict lpf-1 --target 5 --plant mujoco", "trained"),
    ("evaluate nosuch", "nosuch is no policy"),
    ("evaluate lpf-1 --pairs 0", "--pairs must be a whole number from 1 to 10000, got 0"),
    ("evaluate lpf-1 --pairs 10000000000000", "--pairs must be a whole number from 1 to 10000, got 10000000000000"),
    ("evaluate lpf-1 --pairs many", "--pairs"),
    ("export lpf-1", "say what to write"),
    ("export nosuch --onnx x.onnx", "nosuch is no policy"),
    ("export lpf-1 --onnx folder", "--onnx folder is a folder"),
    ("export lpf-1 --onnx x --sb3 x", "name the same file"),
    # convert, compare
    ("convert lpf-1", "say what to write: --bids FOLDER, --parquet FILE.parquet, or both"),
    ("convert nosuch --bids x", "nosuch is no policy"),
    ("convert folder --bids x", "folder is no policy"),
    ("convert nosuch.npz --bids x", "cannot read nosuch.npz"),
    ("convert step.csv --bids x", "step.csv is no policy"),
    ("convert lpf-1 --bids folder", "folder is not an empty folder; name a new one"),
    ("convert lpf-1 --bids command.csv", "command.csv is not an empty folder"),
    ("convert lpf-1 --bids x --subject a-b", "made of letters and digits, got 'a-b'"),
    ("convert lpf-1 --bids x --rate 0", "rate must be a number from 1 to 100000 Hz, got 0"),
    ("convert lpf-1 --bids x --rate nan", "rate must be .* got nan"),
    ("convert lpf-1 --parquet x --rate 500", "--rate is that of the data set"),
    ("convert lpf-1 --parquet folder", "--parquet folder is a folder"),
    ("convert lpf-1 --parquet pairs.csv --pairs pairs.csv", "--parquet and --pairs name the same file"),
    ("convert lpf-1 --bids x --target 500", "target at 500 deg"),
    ("convert lpf-1 --bids x --start 5", "name a saccade by --start and --target"),
    ("convert nosuch.npz --bids x --target 5", "--target and --pairs are a policy's"),
    ("compare gaze.csv", "--policy"),
    ("compare gaze.csv --policy nosuch", "nosuch is no policy"),
    ("compare nosuch.csv --policy lpf-1", "cannot read nosuch.csv"),
    ("compare garbage.csv --policy lpf-1", "cannot read garbage.csv"),
    ("compare empty.csv --policy lpf-1", "empty.csv is empty; it needs a header"),
    ("compare pairs.csv --policy lpf-1", "pairs.csv has no column of time: .* name it by --time"),
    ("compare sent.csv --policy lpf-1", "sent.csv has no column of horizontal gaze: .* name it by --x"),
    ("compare gaze_ms.csv --policy lpf-1", "is time in ms. Then say --time-unit ms .500 Hz"),
    ("compare gaze.csv --policy lpf-1 --time-unit ms", "is time in s. Then say --time-unit s .500 Hz"),
    ("compare gaze.csv --policy lpf-1 --time-unit h", "--time-unit"),
    ("compare gaze_back.csv --policy lpf-1", "time must rise from row to row"),
    ("compare gaze_gaps.csv --policy lpf-1", "no sample of gaze with all its numbers"),
    ("compare gaze_rad.csv --policy lpf-1", "are these radians.* 0 saccades were found"),
    ("compare gaze.csv --policy lpf-1", "1 saccades were found, a main sequence needs at least 3"),
    ("compare gaze.csv --policy lpf-1 --y x", "different columns"),
    ("compare gaze.csv --policy lpf-1 --x z", "has no column z"),
    ("compare gaze.csv --policy lpf-1 --threshold 0", "--threshold must be a number from 1 to 1000 deg/s, got 0"),
    ("compare gaze.csv --policy lpf-1 --least nan", "--least must be .* got nan"),
    ("compare alike.csv --policy lpf-1", "all 3 saccades have 1.* deg; a main sequence needs amplitudes that differ"),
    ("compare three.csv --policy lpf-1 --out folder", "folder exists and is not an empty folder"),
    # check
    ("check nosuch --command sent.csv --executed step.csv", "nosuch"),
    ("check thesis --command sent.csv", "--executed"),
    ("check thesis --command sent.csv --executed step_ms.csv", "step_ms.csv: 120 rows are 5 s apart.* are these ms"),
    ("check thesis --command sent_ms.csv --executed step.csv", "sent_ms.csv: 500 rows are 1 s apart.* are these ms"),
    ("check thesis --command sent.csv --executed step_far.csv", "angles are in deg"),
    ("check thesis --command sent.csv --executed step.csv --sent-at nan", "--sent-at must be a number s, got nan"),
    ("check thesis --command sent.csv --executed step.csv --sent-at 9", "before the command is sent at 9 s"),
    ("check thesis --command sent.csv --executed step.csv --sent-at -1e308", "how long a movement lasts must be"),
    ("check thesis --command sent.csv --executed step.csv --band 0", "settling band .* got 0"),
    ("check thesis --command sent.csv --executed step.csv --band nan", "settling band .* got nan"),
    ("check thesis --command sent.csv --executed step.csv --axis pitch", "the predicted eye does not move"),
    ("check thesis --command sent.csv --executed step.csv --out sent.csv", "--out and --command name the same file"),
    ("check thesis --command sent.csv --executed sent.csv", "no angle of the eye"),
    # optimum
    ("optimum", "name a saccade by --start and --target"),
    ("optimum --target 5 --start 5", "saccade 1 starts at its target"),
    ("optimum --target 1e-300", "saccade 1 starts at its target"),
    ("optimum --target 500", "target at 500 deg: the eye of plant 'lpf' can be held between"),
    ("optimum --pairs pairs_same.csv", "pairs_same.csv, line 4: the saccade starts at its target"),
    ("optimum --pairs pairs_far.csv", "pairs_far.csv, line 4: target at 500 deg"),
    ("optimum --target 5 --weights 1 2 3", "4 weights"),
    ("optimum --target 5 --weights 0 0 0 0", "not all 0"),
    ("optimum --target 5 --weights 1 -1 1 1", "weight.* got .*-1"),
    ("optimum --target 5 --weights 1 nan 1 1", "weight.* got .*nan"),
    ("optimum --target 5 --band 1e-300", "settling band must be a number from 0.0001 to 0.9999, got 1e-300"),
    ("optimum --target 5 --C 50", "name the pulse too"),
    ("optimum --target 5 --case 1 --pulse 2", "--case and --pulse exclude each other"),
    ("optimum --target 5 --pulse 2 --C fast", "'varying'"),
    ("optimum --target 5 --out folder", "--out folder is a folder"),
    # weights
    ("weights --band 0", "settling band must be a number from 0.0001 to 0.9999, got 0"),
    ("weights --band 1", "settling band .* got 1; it is a share of the amplitude"),
    ("weights --band true", "--band: could not convert string to float: 'true'"),
    ("weights --case 1 --B 1e308", r"B of the chosen saccade must be a number from 0\.01 to 10000 1/s, got 1e.308"),
    ("weights --case 1 --B 0", "B of the chosen saccade .* got 0"),
    ("weights --case 1 --k0 nan", "k0 of the chosen saccade .* got nan"),
    ("weights --case 1 --D 1e308", "an angle of the chosen saccade .* got 1e.308"),
    ("weights --case 1 --D 1 2", "D is one number for each of the 1 driven motors"),
    ("weights --case 1 --step-B 0", "step of the difference in B must be a number from 0.0001 to 5, got 0"),
    ("weights --case 1 --step-k0 1e308", "step of the difference in k0 .* got 1e.308"),
    ("weights --case 1 --target 170", "target at 170 deg: the eye of plant 'lpf' can be held between"),
    ("weights --case 1 --start 30 --target 30", "choose another target"),
    ("weights --case nosuch", "invalid choice 'nosuch' for argument '--case'"),
    ("weights --targets vertical", "no motor of plant 'lpf' turns the eye in pitch; choose other targets"),
    ("weights --pulse 1 --C 200", "pulse '1' has no onset rate C; leave C = 200.0 out"),
    ("weights --pulse 2 --C 0", "onset rate C must be a number from 1 to 100000 1/s, got 0; or 'varying'"),
    ("weights --pulse 2 --C 1e308", "onset rate C .* got 1e.308"),
    ("weights --pulse 2 --C varying --speed-limit 0", "speed limit must be a number from 1 to 100000 deg/s, got 0"),
    ("weights --pulse 2 --C varying --speed-limit 1e308", "speed limit .* got 1e.308"),
    # listing
    ("listing --gaze 20", r"--gaze takes YAW \[deg\], PITCH \[deg\]: as many numbers, not 1"),
    ("listing --gaze nan 0", "yaw must be a number from -90 to 90 deg, got nan"),
    ("listing --gaze 0 1e308", "pitch must be a number from -90 to 90 deg, got 1e.308"),
    ("listing --gaze 0 0 --torsion 1e9", "torsion must be a number from -90 to 90 deg"),
    ("listing --torsion 5", "name the direction too, by --gaze YAW PITCH"),
    ("listing --gaze 0 0 --motors 1 2 3", "ask different questions"),
    ("listing --motors 1 2", "has 3 motors .* got 2 positions"),
    ("listing --motors 1 2 90", "motor3 must be a number from -80 to 80 deg, got 90"),
    ("listing --plant lpf", "no elastics are known"),
    ("listing tavares-gaze --gaze 0 0", "leave the policy out"),
    ("listing tavares-gaze --saccades 0", "--saccades must be a whole number from 8 to 10000, got 0; a plane"),
    ("listing tavares-gaze --saccades 10000000000", "--saccades must be .* got 10000000000; .* take 1 GB"),
    ("listing tavares-gaze --sequences 0", "--sequences must be a whole number from 1 to 10000, got 0"),
    ("listing tavares-gaze --seed -1", "--seed must be a whole number of at least 0, got -1"),
    # validate
    ("validate --random-runs -1", "number of random runs must be a whole number from 0 to 10000, got -1; 20 are usual"),
    ("validate --random-runs 100000000000", "random runs must be .* got 100000000000"),
    ("validate --seed -1", "seed must be a whole number of at least 0, got -1"),
    ("validate --seed true", "--seed: invalid literal"),
]  # fmt: skip


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files, good and bad; those called six are of the eye of that name."""
    folder = write_pool(tmp_path_factory.mktemp("pool"))
    for name, rows in SIX.items():
        (folder / name).write_text(rows)
    return folder


@pytest.mark.parametrize(("line", "message"), LINES, ids=[line for line, _ in LINES])
def test_a_command_line_is_refused(
    line: str, message: str, pool: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(pool)
    before = sorted(pool.rglob("*"))
    with pytest.raises(SystemExit) as ended:
        main(shlex.split(line))
    told = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert ended.value.code == 2, told
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(told)
    assert "Traceback" not in told
    assert sorted(pool.rglob("*")) == before, "something is left"


def test_every_command_has_rows() -> None:
    assert {line.split()[0] for line, _ in LINES} >= set(COMMANDS)
    assert len(LINES) > 120


def test_programs_read_the_same_message(pool: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(pool)
    with pytest.raises(SystemExit):
        main(["weights", "--band", "0", "--json"])
    assert capsys.readouterr().out.startswith('{"error": "the settling band must be')


# --- Python ---------------------------------------------------------------------------------------


def lpf() -> Any:
    return oe.make_plant("lpf")


def task(**options: Any) -> Any:
    return oe.SaccadeTask.of_case(lpf(), **{"weights": (1.0, 1.0, 1.0, 1.0), **options})


def looking(count: int) -> Any:
    return oe.State(np.tile([1.0, 0, 0, 0], (count, 1)), np.zeros((count, 1)))


CALLS: list[tuple[str, Callable[[], Any], str]] = [
    ("plant", lambda: oe.make_plant("nosuch"), "unknown plant 'nosuch'"),
    ("option", lambda: oe.make_plant("lpf", eye="thesis"), "its options are"),
    ("threads", lambda: oe.make_plant("mujoco", threads=1.5), "threads"),
    ("pretension", lambda: oe.make_plant("mujoco", eye="six", pretension="1"), "pretension must be a number, got '1'"),
    ("pretension", lambda: oe.make_plant("tavares", eye="six", pretension=HUGE), "pretension must be a number"),
    ("pretension", lambda: oe.make_plant("tavares", eye="six", pretension=1.5), "no pretension 1.5: choose one"),
    ("K", lambda: oe.Surrogate(NAN, 17.5), "K"),
    ("K", lambda: oe.Surrogate(HUGE, 17.5), "K"),
    ("K", lambda: oe.Surrogate(True, 17.5), "K"),
    ("w0", lambda: oe.Surrogate(1.5, -1.0), "w0"),
    ("w0", lambda: oe.Surrogate(1.5, "17 rad/s"), "w0"),  # type: ignore[arg-type]  # on purpose
    ("zeta", lambda: oe.Surrogate(1.5, wn=20.0, zeta=0.0), "zeta"),
    ("dead time", lambda: oe.Surrogate(1.5, 17.5, dead_time=8.0e3), "dead_time"),
    ("range", lambda: oe.Motor("m", range=(5.0, -5.0)), "a range goes from low to high"),
    ("range", lambda: oe.Motor("m", range=(NAN, 5.0)), "a range goes from low to high"),
    ("limit", lambda: oe.Motor("m", speed_limit=0.0), "limit"),
    ("limit", lambda: oe.Motor("m", acceleration_limit=NAN), "limit"),
    ("state", lambda: oe.State(np.ones((1, 3)), np.zeros((1, 1))), "orientations"),
    ("pulse", lambda: oe.PulseStep(*np.ones((4, 1, 1)), pulse="9"), "unknown pulse '9'"),
    ("pulse", lambda: oe.PulseStep(*np.ones((4, 1, 1)), pulse="2"), "needs C"),
    ("pulse", lambda: oe.PulseStep(np.zeros((1, 1)), -np.ones((1, 1)), *np.ones((2, 1, 1))), "B must be positive"),
    ("positions", lambda: oe.Sampled([[1.0], [1.0, 2.0]], 0.001), "array of real numbers"),
    ("positions", lambda: oe.Sampled(np.zeros((1, 0, 1)), 0.001), "shape"),
    ("step", lambda: oe.Sampled(np.zeros((1, 5, 1)), 0.0), "step|interval"),
    ("move", lambda: lpf().move(np.zeros((1, 5, 2))), "motor"),
    ("horizon", lambda: lpf().move(np.zeros((1, 5, 1)), horizon_s=NAN), "how long a movement lasts .* got nan"),
    ("horizon", lambda: lpf().move(np.zeros((1, 5, 1)), horizon_s=1e308), "how long a movement lasts .* got 1e.308"),
    ("command", lambda: oe.read_command("nosuch.csv", lpf().motors), "nosuch.csv"),
    ("targets", lambda: oe.make_targets("nosuch", lpf()), "unknown target 'nosuch'"),
    ("range", lambda: oe.make_targets("horizontal", lpf(), limit_deg=NAN), "range of horizontal targets .* got nan"),
    ("range", lambda: oe.make_targets("horizontal", lpf(), limit_deg=HUGE), "range of horizontal targets"),
    ("cone", lambda: oe.make_targets("gaze", lpf(), limit_deg="30"), "cone of gaze targets .* got '30'"),
    ("torsion", lambda: oe.make_targets("gaze", lpf(), torsion_deg=-1.0), "torsion of starts .* got -1"),
    ("driven", lambda: oe.make_targets("horizontal", lpf(), driven=("m9",)), "cannot drive"),
    ("drawn", lambda: task().targets.draw(-1, RANDOM), "number of saccades .* got -1"),
    ("drawn", lambda: task().targets.draw(10**12, RANDOM), "from 0 to 1000000, got 1000000000000; .* GB"),
    ("drawn", lambda: task().targets.draw(1.5, RANDOM), "whole number .* got 1.5"),
    ("saccades", lambda: oe.saccades(task().targets, [[0.0]], [[5.0, 5.0]]), "shape"),
    ("case", lambda: task(case="9"), "unknown case '9'"),
    ("band", lambda: task(band=NAN), "settling band .* got nan"),
    ("band", lambda: task(band=True), "settling band .* got True"),
    ("band", lambda: task(band="0.01"), "settling band .* got '0.01'"),
    ("horizon", lambda: task(horizon_s=-0.5), "horizon .* got -0.5"),
    ("horizon", lambda: task(horizon_s=500.0 * 3600), "horizon must be a number from 0.001 to 3600 s"),
    ("weights", lambda: task(weights=(1.0, 1.0)), "4 weights"),
    ("weights", lambda: task(weights=(INF, 1, 1, 1)), "weight"),
    ("weights", lambda: task(weights={"speed": 1.0}), "speed"),
    ("C", lambda: task(case=Case("2", NAN)), "onset rate C .* got nan"),
    ("C", lambda: task(case=Case("2", "fast")), "onset rate C .* got 'fast'; or 'varying'"),
    ("C", lambda: task(case=Case("1", 50.0)), "has no onset rate C"),
    ("speed limit", lambda: task(case="2-varying", speed_limit=-7200.0), "speed limit .* got -7200"),
    ("rates", lambda: task(action_options={"rates": {"B": (80, 18), "k0": (5, 40)}}), "B of an action goes from"),
    ("rates", lambda: task(action_options={"rates": {"B": (18, NAN), "k0": (5, 40)}}), "B of an action goes from"),
    ("perform", lambda: task().perform(looking(1), np.zeros((2, 3)), looking(1).orientation), "actions"),
    ("search", lambda: oe.find_optimum(task(), looking(1), looking(1).orientation, RANDOM, effort=0.0),
     "effort of a search must be a number from 0.01 to 1000, got 0"),
    ("search", lambda: oe.find_optimum(task(), looking(1), looking(1).orientation, RANDOM, effort=HUGE),
     "effort of a search"),
    ("chosen", lambda: ChosenSaccade(k0=0.0), "k0 of the chosen saccade"),
    ("chosen", lambda: ChosenSaccade(target=(NAN,)), "an angle of the chosen saccade"),
    ("steps", lambda: Steps(B="0.2"), "difference in B .* got '0.2'"),  # type: ignore[arg-type]  # on purpose
    ("solved", lambda: oe.solve_weights(task(), ChosenSaccade(D=(79.9,), target=(170.0,))), "target at 170 deg"),
    ("steps", lambda: oe.identify_plant(lpf(), [1.0] * 1001), "number of steps .* from 1 to 1000, got 1001"),
    ("steps", lambda: oe.identify_plant(lpf(), ["5 deg"]), "amplitude of a step .* got '5 deg'"),  # type: ignore[list-item]  # on purpose
    ("steps", lambda: oe.identify_plant(lpf(), [HUGE]), "amplitude of a step"),
    ("model", lambda: oe.identify_plant(lpf(), [5.0], model="nosuch"), "a model is best"),
    ("recordings", lambda: oe.identify_recordings([]), "no recording to identify"),
    ("modes", lambda: oe.identify_modes(lpf(), RANDOM), "three motors or more and three axes"),
    ("modes", lambda: oe.identify_modes(lpf(), RANDOM, fitted=10**12), "pulse-steps fitted .* got 1000000000000"),
    ("modes", lambda: oe.identify_modes(lpf(), RANDOM, worth=NAN), "is worth .* got nan"),
    ("modes", lambda: oe.identify_modes(lpf(), RANDOM, order="third"), "an order is best"),
    ("config", lambda: oe.TrainConfig(learning_rate=NAN).resolved(task()), "learning rate|learning_rate"),
    ("policy", lambda: oe.Policy.load("nosuch"), "nosuch is no policy"),
    ("eye", lambda: oe.build_model("nosuch"), "unknown eye 'nosuch'"),
]  # fmt: skip


@pytest.mark.parametrize(("what", "call", "message"), CALLS, ids=[f"{i} {row[0]}" for i, row in enumerate(CALLS)])
def test_a_call_is_refused(what: str, call: Callable[[], Any], message: str) -> None:
    with pytest.raises(oe.InputError, match=message):
        call()
