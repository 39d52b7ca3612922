"""`orient-eye listing POLICY`: torsion of a sequence of saccades."""

from typing import TYPE_CHECKING, Any

from orient_eye.checks import whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from orient_eye.cli.listing import Listing
    from orient_eye.learning.sequences import Sequence

_HORIZON_S = 1.5  # of the saccades of a sequence
_SHOWN = 12  # saccades of a sequence
_MOST = 10_000  # saccades of all sequences
_COLUMNS = 4  # saccades beside each other
_STARTS = {"ahead": "straight ahead", "fick": "aside at the torsion of Fick's gimbal"}


def sequences_of(command: "Listing", name: str) -> dict[str, Any]:
    """What `orient-eye listing POLICY` does with its options.

    Raises:
        InputError: numbers of saccades that are none, or see `Policy.load`, `AnotherPlant.task`.
    """
    from dataclasses import asdict, replace

    import numpy as np

    from orient_eye.cli.tables import say
    from orient_eye.files import write_table
    from orient_eye.learning import sequences as made_by
    from orient_eye.learning.policy import Policy
    from orient_eye.progress import progress_bar
    from orient_eye.recording.sequence import record_sequence
    from orient_eye.run_directory import RunDirectory
    from orient_eye.task.table import rows_of
    from orient_eye.words import plant_in_words

    whole("--seed", command.seed, 0)
    whole("--sequences", command.sequences, 1, _MOST)
    fewest = -(-made_by.FEWEST // command.sequences)
    plane = f"a plane is fitted through {made_by.FEWEST} saccades or more, and {_MOST} take 1 GB"
    whole("--saccades", command.saccades, fewest, _MOST // command.sequences, advice=plane)
    policy = Policy.load(name)
    task, differences = command.another_plant.task(policy)
    random = np.random.default_rng(command.seed)
    start, target = made_by.drawn(task, command.sequences, command.saccades, random)
    if command.start == "fick":
        start = made_by.ficks_starts(task, command.sequences, random)
    run = RunDirectory.create(command.out, "listing", asdict(command), seed=command.seed)
    with progress_bar("making saccades", quiet=command.quiet) as advance:
        longer = replace(task, horizon_s=max(task.horizon_s, _HORIZON_S))  # so that each is seen to come to rest
        made = made_by.sequence(longer, policy.act, target, start, advance)
    result = {
        "out": str(run.path),
        "policy": name,
        "plant": task.plant.name,
        "task": longer.identity(),
        "differs_from_training": differences,
        "start": command.start,
        **made_by.listing_numbers(made),
        "stretching": made_by.stretching(made, policy.act),
        "imposed": made_by.imposed(task),
    }
    _say_sequences(result)
    run.write_json("result.json", result)
    write_table(run.path / "sequence.csv", rows_of(made_by.torsion_columns(made)))
    from orient_eye.figures import save

    pictures = _pictures(made)
    for picture, figure in pictures.items():
        save(figure, run.path / f"{picture}.png")
    shown = slice(min(_SHOWN, len(made)))
    record_sequence(
        run.path / "sequence.rrd",
        made.trajectory[shown],
        model=task.plant.drawn(),
        target=made.target[shown],
        notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, one after the other.",
    )
    files = ", ".join(f"{picture}.png" for picture in pictures)
    say(f"in {run.path}: result.json, sequence.csv, {files}, sequence.rrd")
    say(f"the numbers are of all saccades, pictures over time and the recording of the first {shown.stop}")
    say(f"look at the saccades: orient-eye view {run.path}/sequence.rrd")
    return result


def _say_sequences(result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import column, number, say, table

    told = {
        "ends": "ends of the saccades",
        "on_the_way": "on the way",
        "least_force": "the same gaze, least force",
        "usual": "the same targets, usual command",
        "fick": "the same gaze, Fick's gimbal",
    }
    rows = [{"of": words, **result[key]} for key, words in told.items() if result[key] is not None]
    columns = {
        "sd [deg]": column("sd_deg", ".2f"),
        "tilt left [deg]": column("tilt_left_deg", "+.2f"),
        "tilt down [deg]": column("tilt_down_deg", "+.2f"),
        "twist": column("twist", "+.3f"),
        "sd about the twisted surface [deg]": column("twisted_sd_deg", ".3f"),
    }
    say(table("Listing's plane.", {"orientations": lambda row: row["of"], **columns}, rows, left=("orientations",)))
    first = {
        "after": lambda row: f"{row['saccades']} saccades",
        "sd [deg]": columns["sd [deg]"],
        "twist": columns["twist"],
        "last end beside the least force [deg]": column("last_beside_least_force_deg", ".3f"),
    }
    say(table(f"How it came about, from a start {_STARTS[result['start']]}.", first, result["first"]))
    error, path, blip = (result[key] for key in ("gaze_error_deg", "path_deviation", "torsion_blip_deg"))
    say(f"gaze ends off by {error['mean']:.3f} deg in the mean, {error['largest']:.3f} at most")
    median, most = (100 * path[of] for of in ("median", "p95"))
    say(f"paths deviate by {median:.1f} % of the amplitude in the median, 95 % of them by less than {most:.1f} %")
    correlation, stretching = result["component_correlation"], result["stretching"]
    say(
        f"components' velocities correlate by {number(correlation['median'], '.3f')} in the median, "
        f"{number(correlation['least'], '.3f')} at least"
    )
    say(
        f"the smaller component takes {number(stretching['smaller']['median'], '.2f')} times as long as alone (median "
        f"of {stretching['smaller']['compared']}), the larger {number(stretching['larger']['median'], '.2f')} times"
    )
    say(f"blips of torsion: median {blip['median']:.2f} deg, largest {blip['largest']:.2f} deg")
    if result["not_settled"]:
        say(f"{result['not_settled']} of {result['saccades']} saccades did not settle within the horizon", "yellow")
    say(result["imposed"])
    ends, beside = result["ends"], result["beside_least_force_deg"]
    apart = ""
    if beside is not None:
        apart = f"; beside the torsion of the least force {beside['mean']:+.2f} deg, sd {beside['sd']:.2f}"
    usual = result["usual"]
    alone = (
        "" if usual is None else f"; by the usual command alone sd {usual['sd_deg']:.2f}, twist {usual['twist']:+.2f}"
    )
    say(
        f"What came of it: ends within sd {ends['sd_deg']:.2f} deg of a plane, twist {ends['twist']:+.2f} (Listing 0, "
        f"Fick -1){alone}{apart}. Only what differs from the usual command has emerged."
    )


def _pictures(made: "Sequence") -> "dict[str, Figure]":
    import numpy as np

    from orient_eye import listing, rotations
    from orient_eye.figures import gaze
    from orient_eye.learning.sequences import least_force, on_the_way
    from orient_eye.movement.oblique import end_of_shift

    looks, surface = rotations.gaze(made.measures.final), least_force(made.task)
    laws = {} if surface is None else {"least force": surface.orientation(looks)}
    laws["Fick's gimbal"] = listing.with_torsion(looks, listing.ficks_torsion(looks))
    shown = np.arange(min(_SHOWN, len(made)))
    oblique = np.argsort(-np.abs(end_of_shift(made.trajectory, made.measures)).min(axis=1))[:_COLUMNS]
    few = {name: (made.trajectory[which], made.measures[which]) for name, which in (("s", shown), ("o", oblique))}
    return {
        "plane": gaze.listing_plane(made.measures.final, on_the_way(made), laws),
        "sequence": gaze.saccade_sequence(*few["s"], made.target[shown]),
        "torsion": gaze.torsion_over_time(*few["s"]),
        "components": gaze.component_velocities(*few["o"]),
        "motors": gaze.motors_over_time(*few["o"]),
        "main_sequence": gaze.main_sequence(made.trajectory, made.measures),
    }
