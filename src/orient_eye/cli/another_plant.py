"""Options that predict and evaluate share: a policy on another plant than its own."""

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import tyro

if TYPE_CHECKING:
    from orient_eye.learning.policy import Policy
    from orient_eye.task.saccade import SaccadeTask


@dataclass(frozen=True)
class AnotherPlant:
    """To use the policy on another plant than its own, or on a rig (--rig alone: its own plant with those limits)."""

    plant: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: the policy's own)")] = None
    """The plant; one the policy was not trained on is refused without --force."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    force: bool = False
    """Use the policy although the plant is not the one it was trained on."""

    def _of_policy(self, name: str, own: dict[str, Any]) -> dict[str, Any]:
        """Eye and pretension of the policy's plant, for another kind of plant that has such, unless they are told."""
        from orient_eye.plants import PLANTS

        known = {option.name for option in PLANTS[name].options} - set(self.plant_options)
        told = ("pretension",) if self.plant_options.get("eye", own.get("eye")) == own.get("eye") else ()
        return {key: own[key] for key in ("eye", *told) if key in own and key in known}

    def task(self, policy: "Policy") -> "tuple[SaccadeTask, list[str]]":
        """The task on that plant, and in words what differs from the one the policy was trained on.

        Raises:
            InputError: something differs, and it is not forced.
        """
        from orient_eye.cli.tables import say
        from orient_eye.plants import make_plant, restore_plant
        from orient_eye.run_directory import plain

        own = policy.manifest["task"]["plant"]
        plant = None
        if self.plant is not None:
            plant = make_plant(self.plant, **self._of_policy(self.plant, own), **self.plant_options)
        elif self.plant_options:  # of its own plant only the limits can be others
            plant = restore_plant(own, **self.plant_options)
            same = json.loads(json.dumps(plant.identity(), default=plain)) == own
            plant = None if same else plant
        task = policy.task(plant)
        differences = policy.require(task, force=self.force)
        if differences:
            say(f"forced: this policy was trained for {'; '.join(differences)}", "yellow")
        return task, differences
