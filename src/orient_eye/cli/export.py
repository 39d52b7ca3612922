"""orient-eye export."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True)
class Export:
    """Write a policy for other programs: as ONNX, or as a zip of Stable-Baselines3.

    The ONNX model takes the orientations start and target (n, 4), quaternions w, x, y, z, float32, and
    gives action (n, numbers): B [1/s], D [deg], k0 [1/s] of each driven motor.

    A Stable-Baselines3 zip holds pickles: loading one runs the code of whoever wrote it. Load zips only
    from people you trust; what runs no code is the policy itself (docs/policies.md).

    $ orient-eye export runs/my-run --onnx policy.onnx

    $ orient-eye export runs/my-run --sb3 policy.zip
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    onnx: Annotated[Path | None, _OPTIONAL] = None
    """ONNX file to write; needs pip install "orient-eye[onnx]"."""
    sb3: Annotated[Path | None, _OPTIONAL] = None
    """Stable-Baselines3 zip to write. Loading such a zip runs code (pickle): only from people you trust."""

    def run(self) -> dict[str, Any]:
        """Write the files that were asked for."""
        from orient_eye.cli.places import check_outputs, policy_file
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError
        from orient_eye.learning.policy import Policy
        from orient_eye.learning.policy_export import export_onnx, export_sb3

        if not self.onnx and not self.sb3:
            raise InputError("say what to write: --onnx FILE.onnx, --sb3 FILE.zip, or both")
        policy = Policy.load(self.policy)
        check_outputs({"--onnx": self.onnx, "--sb3": self.sb3}, {"the policy": policy_file(self.policy)})
        if self.onnx:
            say(f"in {export_onnx(policy, self.onnx)}")
        if self.sb3:
            say(f"in {export_sb3(policy, self.sb3)}; loading it runs code (pickle)")
        written = {"onnx": self.onnx, "sb3": self.sb3}
        return {"policy": self.policy, **{name: str(path) if path else None for name, path in written.items()}}
