"""What edits of the default chain do to both models: a table of models/README.md.

python docs/made/edits.py
"""

from __future__ import annotations

from pathlib import Path

from asked import ROOT, asked, numbers, own_folder, row

DEFAULT = (ROOT / "models" / "chain6.xml").read_text(encoding="utf-8")
TIP = '<site name="tip" pos="0.03469 0 0"/>'
PAYLOAD = (
    '<body name="payload" pos="0.03469 0 0">',
    '<inertial pos="0 0 0" mass="0.05" diaginertia="5e-6 5e-6 5e-6"/>',
)
INSIDE = f"`{PAYLOAD[0]}` with `{PAYLOAD[1]}` inside `segment6`"


def changed(old: str, new: str) -> str:
    """Return the default chain with a passage replaced, which must be there."""
    if old not in DEFAULT:
        raise ValueError(f"chain6.xml has no {old}")
    return DEFAULT.replace(old, new)


def written(*words: object) -> str:
    """Return the file of `flexsim chain WORDS`."""
    asked("chain", *words, "--out", "written.xml", "--force")
    return Path("written.xml").read_text(encoding="utf-8")


def main() -> None:
    """Print a row per edit."""
    edits = {
        "none": DEFAULT,
        f"50 g at the tip: {INSIDE}": changed(TIP, f"{TIP}{''.join(PAYLOAD)}</body>"),
        "half the stiffness of `hinge3`: 1.7289396854": changed(
            'stiffness="3.45787937081"', 'stiffness="1.7289396854"'
        ),
        "1 % damping ratio in mode 1: `flexsim chain --robot.zeta 0.01 --timestep 0.0005`": written(
            "--robot.zeta", 0.01, "--timestep", 0.0005
        ),
        "a beam 20 % longer: `flexsim chain --robot.L 0.6`": written("--robot.L", 0.6),
        "inertia of `link1` doubled: 0.5": changed(
            'diaginertia="0.25 0.25 0.25"', 'diaginertia="0.5 0.5 0.5"'
        ),
        "4 segments: `flexsim chain --segments 4`": written("--segments", 4),
        "16 segments: `flexsim chain --segments 16 --timestep 1e-4`": written(
            "--segments", 16, "--timestep", 1e-4
        ),
    }
    for name, text in edits.items():
        Path("my.xml").write_text(text, encoding="utf-8")
        modes, check = asked("modes", "my.xml"), asked("crosscheck", "--mjcf", "my.xml")
        small, large = (r["value"] for r in check["rungs"] if r["name"].startswith("open loop"))
        free = [modes["joint_free_hz"][model][0] for model in ("assumed_modes", "chain")]
        clamped = numbers(modes["clamped_hz"]["chain"], ".3f")
        row(name, clamped, numbers(free, ".3f"), f"{1e6 * small:.1f}, {1e6 * large:.0f}")


if __name__ == "__main__":
    with own_folder():
        main()
