"""`orient-eye sysid --all-motors`: a linear surrogate of a plant that all its motors turn."""

from typing import TYPE_CHECKING, Any

from orient_eye.checks import whole
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.cli.sysid import Sysid
    from orient_eye.sysid.modes import ModesIdentification

SURROGATE, REPORT, RESIDUALS, PICTURE = "surrogate_3d.json", "report.json", "residuals.csv", "modes.png"
_OTHERS = (
    "plan", "physical", "recording", "amplitudes", "held_out", "motor", "axis", "until", "force", "frozen",
)  # fmt: skip
_MODELS = {None: "best", "best": "best", "first_order": "first_order", "second_order": "second_order"}


def modes_of(command: "Sysid") -> dict[str, Any]:
    """What `orient-eye sysid --all-motors` does with its options.

    Raises:
        InputError: options that say nothing here, or see `identify_modes`.
    """
    import numpy as np

    from orient_eye.cli.tables import say
    from orient_eye.figures import save
    from orient_eye.figures.modes import draw_modes
    from orient_eye.files import write_table
    from orient_eye.plants import make_plant
    from orient_eye.run_directory import RunDirectory
    from orient_eye.sysid.modes import identify_modes

    for name in (name for name in _OTHERS if getattr(command, name) not in (None, False)):
        raise InputError(f"--{name.replace('_', '-')} says nothing to --all-motors; leave it out")
    if command.model not in _MODELS:
        raise InputError(
            f"a surrogate of all motors is of first_order or second_order, without dead time; got {command.model}"
        )
    limits = {} if command.rig is None else {"rig": command.rig}
    plant = make_plant(command.plant, **command.plant_options, **limits)
    seed = whole("--seed", command.seed or 0, 0)
    found = identify_modes(plant, np.random.default_rng(seed), order=_MODELS[command.model])
    run = RunDirectory.create(command.out, "sysid", command, seed=seed)
    found.surrogate.save(run.path / SURROGATE)
    write_table(run.path / RESIDUALS, found.residuals)
    save(draw_modes(found), run.path / PICTURE)
    result: dict[str, Any] = {
        "order": found.order,
        "surrogate": found.surrogate.to_plain(),
        "orders": {name: each.to_plain()["modes"] for name, each in found.orders.items()},
        "rms_deg": found.rms_deg,
        "rings": found.rows,
        "workspace_deg": found.workspace_deg,
        "ran_away": found.ran_away,
        "files": [SURROGATE, REPORT, RESIDUALS, PICTURE],
    }
    run.write_json(REPORT, result)
    _tell(found)
    say(f"predicted and true movements: {run.path}/{PICTURE}")
    file = run.path / SURROGATE
    say(f"surrogate, {found.order.replace('_', ' ')}: {file} (orient-eye train --plant modal --surrogate {file})")
    return {**result, "out": str(run.path)}


def _tell(found: "ModesIdentification") -> None:
    from orient_eye.cli.tables import column, say, table

    rows: list[dict[str, Any]] = [
        {"axis": axis, **dict(zip(found.surrogate.motors, mode.K, strict=True)), **vars(mode)}
        for axis, mode in found.surrogate.modes.items()
    ]
    rates = {"w0": "w0 [rad/s]"} if found.order == "first_order" else {"wn": "wn [rad/s]", "zeta": "zeta"}
    columns = {"axis": lambda row: str(row["axis"])}
    columns |= {f"K {motor}": column(motor, ".4f") for motor in found.surrogate.motors}
    columns |= {heading: column(name, ".4g") for name, heading in rates.items()}
    say(table("The eye's rotation vector, each component by itself.", columns, rows, left=("axis",)))
    columns = {
        "order": lambda row: str(row["order"]).replace("_", " "),
        "eccentricity [deg]": lambda row: _ring(row["from_deg"], row["to_deg"]),
        "rms [deg]": column("rms_deg", ".2f"),
        "largest [deg]": column("largest_deg", ".1f"),
    }
    title = f"Error on {len(found.held_out)} held-out pulse-steps up to {found.workspace_deg:.3g} deg, by gaze."
    say(table(title, columns, found.rows, left=("order", "eccentricity [deg]")))
    if found.ran_away:
        say(
            f"note: {found.ran_away} pulse-steps more ran away, to where the motors do not hold the eye; they are left "
            "out of the fit and of these errors",
            "yellow",
        )


def _ring(low: float, high: float | None) -> str:
    if high is None:
        return "all" if not low else f"beyond {low:g}"
    return f"{low:g} to {high:g}"
